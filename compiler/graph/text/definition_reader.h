// definition_reader.h -- reads the lines of definitions of Funcs. A definition is complete once the
// next one begins; only then are its names bound to their entities.
#pragma once

#include <optional>
#include <vector>

#include "graph/text/declarations.h"

namespace retrograde::graph {

class DefinitionReader {
 public:
  explicit DefinitionReader(const Declarations& declared) : declared_(declared) {}

  // Begins a definition of `f`, after finish().
  void begin(const FuncPtr& f, bool is_update);
  // Reads a line of the open definition; false if there is none, or if the line is of another kind.
  bool reads(const Line& line);
  // Adds the open definition to its Func; without one, does nothing.
  void finish();

 private:
  bool reads_schedule(const Line& line);
  StageLoops& schedule();

  const Declarations& declared_;
  FuncPtr f_;
  std::optional<Definition> definition_;
  bool is_update_ = false;
  std::vector<size_t> specials_;  // indices of the open specializations, outermost first
};

}  // namespace retrograde::graph
