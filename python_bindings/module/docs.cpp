// docs.cpp -- looks docstrings up: see documentation() of binding.h.
#include <algorithm>
#include <string_view>

#include "binding.h"
#include "docs_table.h"

namespace retrograde::python {

namespace {

const char* row(const std::string& name) {
  const DocsRow* end = docs_rows + docs_row_count;
  const DocsRow* found =
      std::lower_bound(docs_rows, end, name, [](const DocsRow& row, const std::string& wanted) {
        return std::string_view(row.name) < wanted;
      });
  return found != end && std::string_view(found->name) == name ? found->text : "";
}

}  // namespace

const char* documentation(std::initializer_list<const char*> scopes, const std::string& name) {
  // in_ and lambda_ have an underscore because the words without it are keywords of Python.
  const std::string bare = name.size() > 1 && name.back() == '_' && name[name.size() - 2] != '_'
                               ? name.substr(0, name.size() - 1)
                               : name;
  for (const char* scope : scopes) {
    const std::string prefix = *scope ? std::string(scope) + "::" : "";
    if (const char* text = row(prefix + bare); *text) return text;
  }
  return "";
}

}  // namespace retrograde::python
