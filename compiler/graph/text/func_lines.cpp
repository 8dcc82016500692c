#include "graph/text/func_lines.h"

#include <map>

namespace retrograde::graph {

namespace {

void begin_provenance(const Line& line, FuncContents& f) {
  const size_t of = line.rest.find(" of ");
  const std::string word = line.rest.substr(0, of);
  Provenance& made = f.made.emplace();
  if (of != std::string::npos) made.of = unquoted(line, line.rest.substr(of + 4));
  for (int r = 0; r < role_count; ++r) {
    made.role = static_cast<Role>(r);
    if (word == role_name(made.role)) return;
  }
  fail(line, "a role of roles.def");
}

void begin_extern(const Line& line, FuncContents& f) {
  const size_t space = line.rest.rfind(' ');
  if (space == std::string::npos) fail(line, "a C function and how its name is mangled");
  const std::string mangling = line.rest.substr(space + 1);
  ExternDefinition& definition = f.extern_definition.emplace();
  definition.function = unquoted(line, line.rest.substr(0, space));
  definition.mangling = mangling == "c"     ? NameMangling::C
                        : mangling == "c++" ? NameMangling::CPlusPlus
                                            : NameMangling::Default;
}

}  // namespace

bool reads_provenance(const Line& line, const Declarations& declared, const FuncPtr& f) {
  if (line.word == "made") {
    begin_provenance(line, *f);
    return true;
  }
  if (!f->made) return false;
  Provenance& made = *f->made;
  AdjointTraits& t = made.traits;
  const std::map<std::string, bool*> flags{{"masked", &t.masked},     {"vanished", &t.vanished},
                                           {"levelled", &t.levelled}, {"singular", &t.singular},
                                           {"infinite", &t.infinite}, {"parts", &made.has_parts}};
  if (const auto flag = flags.find(line.word); flag != flags.end()) {
    *flag->second = true;
  } else if (line.word == "lanes") {
    made.lanes = declared.integer(line);
  } else if (line.word == "blocks") {
    made.blocks = declared.integer(line);
  } else if (line.word == "work") {
    made.work.emplace_back();
  } else if ((line.word == "work_value" || line.word == "work_loop") && !made.work.empty()) {
    (line.word == "work_value" ? made.work.back().values : made.work.back().loops)
        .push_back(declared.expr(line, f));
  } else {
    return false;
  }
  return true;
}

bool reads_extern(const Line& line, const Declarations& declared, const FuncPtr& f) {
  if (line.word == "extern") {
    begin_extern(line, *f);
    return true;
  }
  if (!f->extern_definition) return false;
  ExternArgument arg;
  if (line.word == "give") {
    arg.expr = declared.expr(line, f);
  } else if (line.word == "give_func") {
    arg.kind = ExternArgument::Kind::Func;
    arg.func = declared.func(line, line.rest);
  } else if (line.word == "give_buffer") {
    const auto found = declared.names.parameters.find(unquoted(line, line.rest));
    if (found == declared.names.parameters.end()) fail(line, "an image or buffer of the graph");
    arg.kind = ExternArgument::Kind::Buffer;
    arg.buffer = found->second;
  } else {
    return false;
  }
  f->extern_definition->args.push_back(std::move(arg));
  return true;
}

}  // namespace retrograde::graph
