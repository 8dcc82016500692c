#include "lower/nests/make_names_unique.h"

#include <unordered_map>
#include <unordered_set>

#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "lower/nests/copy_statement.h"

namespace retrograde::lower {
namespace {

using Renamings = std::unordered_map<std::string, std::string>;  // in force

std::string current(const Renamings& renamings, const std::string& name) {
  return value_or(renamings, name, name);
}

// The new name of "f.stride.1" and similar names if Func "f" has been renamed to "f.$1" here.
std::string renamed_metadata(const Renamings& renamings, const std::string& name) {
  const auto parsed = parse_metadata_name(name);
  const auto* now = parsed ? find_or_null(renamings, parsed->buffer) : nullptr;
  return now ? metadata_name(*now, parsed->what, parsed->dimension) : "";
}

// Renames the uses of renamed variables and Funcs.
Expr with_uses_renamed(const Expr& root, const Renamings& renamings) {
  return rewrite(root, [&](const Expr& e, const auto& recurse) -> Expr {
    if (const Variable* v = e.as<Variable>()) {
      if (renamings.count(v->name)) return variable(renamings.at(v->name), v->type, v->symbol);
      const std::string renamed = renamed_metadata(renamings, v->name);
      return renamed.empty() ? e : variable(renamed, v->type, v->symbol);
    }
    const Call* call = e.as<Call>();
    if (!call || call->call_type != CallType::Func || !renamings.count(call->name)) return {};
    const Expr mapped = map_children(e, recurse);
    return call_func(renamings.at(call->name), call->type, mapped.as<Call>()->args, call->component,
                     call->symbol);
  });
}

class Uniquifier {
 public:
  Uniquifier(const Stmt& s, const std::vector<std::string>& taken)
      : fresh_(s), bound_(taken.begin(), taken.end()) {}

  Stmt rename(const Stmt& s) {
    return match(
        s,
        [&](const LetStmt& let) {
          Expr value = rename(let.value);
          Binding name(*this, let.name);
          return make_let(name.unique, value, rename(let.body));
        },
        [&](const For& loop) {
          Expr min = rename(loop.min), extent = rename(loop.extent);
          Binding name(*this, loop.name);
          return make_for(name.unique, min, extent, loop.runs, rename(loop.body), loop.partition);
        },
        [&](const Realize& realize) {
          std::vector<Range> bounds;
          for (const Range& range : realize.bounds)
            bounds.push_back({rename(range.min), rename(range.extent)});
          StorageLayout layout = realize.layout;
          for (Expr& fold : layout.folds) fold = rename(fold);
          layout.first = rename(layout.first);
          layout.place = current(renamings_, layout.place);
          Binding name(*this, realize.name);
          return make_realize(name.unique, realize.types, realize.memory, bounds,
                              rename(realize.body), layout);
        },
        [&](const StmtNode&) {
          return map_children(
              s, [&](const Expr& e) { return rename(e); },
              [&](const Stmt& child) { return rename(child); },
              [&](Kind, const std::string& name) { return current(renamings_, name); });
        });
  }

 private:
  FreshNames fresh_;
  std::unordered_set<std::string> bound_;  // so far, in the whole statement
  Renamings renamings_;

  // A name that is bound from here to the end of its scope.
  struct Binding {
    Binding(Uniquifier& owner, const std::string& name) : owner(owner), name(name), unique(name) {
      if (const auto* now = find_or_null(owner.renamings_, name)) outer = *now;
      owner.renamings_.erase(name);
      if (owner.bound_.insert(name).second) return;
      unique = owner.fresh_(name);
      owner.renamings_[name] = unique;
    }
    ~Binding() {
      owner.renamings_.erase(name);
      if (!outer.empty()) owner.renamings_[name] = outer;
    }
    Uniquifier& owner;
    std::string name, unique, outer;
  };

  Expr rename(const Expr& e) {
    return e.defined() && !renamings_.empty() ? with_uses_renamed(e, renamings_) : e;
  }
};

}  // namespace

Stmt make_names_unique(const Stmt& s, const std::vector<std::string>& taken) {
  return Uniquifier(s, taken).rename(s);
}

}  // namespace retrograde::lower
