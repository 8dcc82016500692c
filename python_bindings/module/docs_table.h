// docs_table.h -- docstrings by the names of C++, sorted: what tools/make_docs.py writes.
#pragma once

#include <cstddef>

namespace retrograde::python {

struct DocsRow {
  const char* name;  // "Func::compute_root"
  const char* text;
};
extern const DocsRow docs_rows[];
extern const std::size_t docs_row_count;

}  // namespace retrograde::python
