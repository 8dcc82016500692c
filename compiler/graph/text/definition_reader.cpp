#include "graph/text/definition_reader.h"

#include "graph/directives/directive_text.h"
#include "ir/build.h"
#include "ir/parse.h"

namespace retrograde::graph {

void DefinitionReader::begin(const FuncPtr& f, bool is_update) {
  f_ = f;
  definition_ = Definition();
  is_update_ = is_update;
  if (!is_update) {
    for (const std::string& arg : f_->args) definition_->args.push_back(variable(arg));
  }
  specials_.clear();
}

bool DefinitionReader::reads(const Line& line) {
  if (!definition_) return false;
  if (line.word == "place") {
    definition_->args.push_back(parse_with_names(line.rest, declared_.types, declared_.names));
  } else if (line.word == "value") {
    definition_->values.push_back(parse_with_names(line.rest, declared_.types, declared_.names));
  } else if (line.word == "where") {
    definition_->predicate = parse_with_names(line.rest, declared_.types, declared_.names);
  } else if (line.word == "loop" || line.word == "points") {
    const std::vector<Expr> args = parse_arguments(line.rest, declared_.types);
    const Variable* v = args.size() == 3 && args[0].defined() ? args[0].as<Variable>() : nullptr;
    if (!v) fail(line, "a variable, its min and its extent");
    definition_->rvars.push_back({v->name, args[1], args[2], line.word == "points"});
  } else {
    return reads_schedule(line);
  }
  return true;
}

bool DefinitionReader::reads_schedule(const Line& line) {
  StageLoops& now = schedule();
  if (line.word == "specialize") {
    StageLoops special;
    special.dims = first_loops(*f_, *definition_);
    special.condition = declared_.expr(line, f_);
    special.is_given = now.is_given = true;
    now.specializations.push_back(std::move(special));
    specials_.push_back(now.specializations.size() - 1);
  } else if (line.word == "end" && !specials_.empty()) {
    specials_.pop_back();
  } else if (const auto directive = declared_.directive(line, true)) {
    apply_directive(*directive, now);
  } else {
    return false;
  }
  return true;
}

// The schedule that directives go to: the stage's, or an open specialization's.
StageLoops& DefinitionReader::schedule() {
  StageLoops* now = &definition_->schedule;
  if (now->dims.empty()) now->dims = first_loops(*f_, *definition_);
  for (const size_t special : specials_) now = &now->specializations[special];
  return *now;
}

void DefinitionReader::finish() {
  if (!definition_) return;
  schedule();  // the loops of the definition, if it has no directives
  DomainPtr domain;
  if (!definition_->rvars.empty()) domain = make_domain(definition_->rvars);
  const Binder bind(declared_.names, f_, domain);
  Definition complete = map_exprs(*definition_, bind);
  if (domain) {
    domain->vars = complete.rvars;
    // The domain refers to its own variables weakly, so that it does not own itself.
    if (complete.predicate.defined())
      domain->predicate = rebind_symbol(complete.predicate, domain.get(), SymbolRef::weak(domain));
  }
  if (is_update_) {
    f_->updates.push_back(std::move(complete));
  } else {
    f_->pure = std::move(complete);
  }
  definition_.reset();
}

}  // namespace retrograde::graph
