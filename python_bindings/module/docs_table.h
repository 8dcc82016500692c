// docs_table.h -- the table of docstrings that tools/make_docs.py writes, sorted by C++ name.
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
