// Checks the rules of each phase in one walk over the statement.
#include "ir/validate.h"

#include <algorithm>
#include <list>
#include <unordered_set>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

const char* phase_name(Phase phase) {
  static constexpr const char* names[] = {"Nests", "Loops", "FlatStorage", "Vector"};
  return names[static_cast<int>(phase)];
}

constexpr size_t shown_characters = 4000;

std::string shortened(std::string text) {
  if (text.size() > shown_characters) text = text.substr(0, shown_characters) + "\n...";
  return text;
}

class Validator {
 public:
  Validator(const Stmt& before, Phase phase, const std::string& pass,
            const std::vector<std::string>& free_names)
      : before_(before),
        phase_(phase),
        pass_(pass),
        visible_(free_names.begin(), free_names.end()),
        bound_(visible_) {}

  void check(const Stmt& s) {
    if (!s.defined()) return;
    match(
        s,
        [&](const LetStmt& n) {
          check(n.value);
          const Binding binding(*this, n.name, s);
          check(n.body);
        },
        [&](const Assert& n) {
          check_scalar_bool(n.condition, s);
          check(n.error);
          require(n.error.type() == Int(32), s, "the error of an Assert is an int32");
        },
        [&](const ProducerConsumer& n) { check(n.body); }, [&](const For& n) { check_for(s, n); },
        [&](const Store& n) { check_store(s, n); }, [&](const Provide& n) { check_provide(s, n); },
        [&](const Realize& n) { check_realize(s, n); },
        [&](const Allocate& n) { check_allocate(s, n); }, [&](const Free& n) { check_free(s, n); },
        [&](const Block& n) {
          for (const Stmt& child : n.stmts) check(child);
        },
        [&](const IfThenElse& n) {
          check_scalar_bool(n.condition, s);
          check_branches(n);
        },
        [&](const Evaluate& n) { check(n.value); }, [&](const Atomic& n) { check(n.body); },
        [&](const Fork& n) {
          check(n.first);
          check(n.rest);
        },
        [&](const Prefetch& n) {
          only_in_loops(s);
          check_bounds(s, n.bounds);
        },
        [&](const Launch& n) { check_launch(s, n); }, [](const StmtNode&) {});
  }

 private:
  template <class Tree>
  [[noreturn]] void fail(const Tree& node, const std::string& rule) const {
    throw InternalError(text("after this pass the program breaks a rule of the phase ",
                             phase_name(phase_), ": ", rule, "\n  in: ", shortened(print(node))),
                        pass_, before_.defined() ? print(before_) : "");
  }
  template <class Tree>
  void require(bool holds, const Tree& node, const char* rule) const {
    if (!holds) fail(node, rule);
  }

  // ---- names ----

  // Binds a name during its lifetime.
  class Binding {
   public:
    template <class Tree>
    Binding(Validator& v, const std::string& name, const Tree& where) : v_(v), name_(name) {
      const bool is_new = v.bound_.insert(name).second;
      if (!is_new && v.phase_ != Phase::Nests)
        v.fail(where, "names are unique: " + quoted(name) + " is bound twice");
      hides_ = !v.visible_.insert(name).second;
    }
    ~Binding() {
      if (!hides_) v_.visible_.erase(name_);
      v_.checked_.clear();  // expressions that mention the name are invalid from now on
    }

   private:
    Validator& v_;
    const std::string name_;
    bool hides_ = false;  // another binding of the name (Phase::Nests)
  };

  // ---- expressions: each node is checked once while the names in scope are unchanged ----
  void check(const Expr& e) {
    if (!checked_.insert(e.get()).second) return;
    check_node(e);
  }
  void check_node(const Expr& e) {
    match(
        e,
        [&](const Variable& n) {
          if (!visible_.count(n.name))
            fail(e, "every variable is bound before use: " + quoted(n.name) + " is not");
        },
        [&](const Let& n) {
          if (!lets_.insert(e).second) return;  // equal nodes bind their name once
          check(n.value);
          const Binding binding(*this, n.name, e);
          check(n.body);
        },
        [&](const Binary& n) { check_binary(e, n); }, [&](const Select& n) { check_select(e, n); },
        [&](const Call& n) { check_call(e, n); }, [&](const Load& n) { check_load(e, n); },
        [&](const Cast& n) {
          check(n.value);
          require(n.type.lanes() == n.value.type().lanes(), e, "a cast keeps the number of lanes");
        },
        [&](const Not& n) {
          check(n.a);
          require(n.type.is_bool(), e, "Not takes bool");
        },
        [&](const Ramp& n) {
          check_children(e);
          require(n.base.type() == n.stride.type(), e, "base and stride of a ramp have one type");
        },
        [&](const ExprNode&) { check_children(e); });
  }
  void check_binary(const Expr& e, const Binary& n) {
    check(n.a);
    check(n.b);
    require(n.a.type() == n.b.type(), e, "both operands have one type");
    const bool logical = n.kind == Kind::And || n.kind == Kind::Or;
    require(!logical || n.a.type().is_bool(), e, "And and Or take bool");
    const bool comparison = n.kind >= Kind::EQ && n.kind <= Kind::GE;
    const Type expected = comparison ? Bool(n.a.type().lanes()) : n.a.type();
    require(n.type == expected, e, "the type of a binary node follows from its operands");
  }
  void check_select(const Expr& e, const Select& n) {
    check_children(e);
    require(n.when_true.type() == n.when_false.type(), e, "both arms of a select have one type");
    require(n.condition.type().is_bool(), e, "the condition of a select is bool");
    const int lanes = n.condition.type().lanes();
    require(lanes == 1 || lanes == n.type.lanes(), e,
            "the condition of a select is scalar or has the arms' lanes");
  }
  void check_call(const Expr& e, const Call& n) {
    check_children(e);
    if (n.call_type == CallType::Operator) {
      const int arity = op_info(n.op).arity;
      require(arity < 0 || arity == static_cast<int>(n.args.size()), e,
              "an operator takes the arguments of its arity");
      return;
    }
    if (n.call_type == CallType::Extern) return;
    if (phase_ > Phase::Loops) fail(e, "calls of Funcs and images belong to the phase Loops");
    for (const Expr& arg : n.args) check_index(arg);
  }
  void check_load(const Expr& e, const Load& n) {
    only_in_flat(e);
    check(n.index);
    check_index(n.index);
    require(n.index.type().lanes() == n.type.lanes(), e, "a load has the lanes of its index");
    check_predicate(e, n.predicate, n.type.lanes());
    check_storage(n.name, e);
  }
  template <class Tree>
  void check_predicate(const Tree& node, const Expr& predicate, int lanes) {
    if (!predicate.defined()) return;
    check(predicate);
    require(predicate.type() == Bool(lanes), node,
            "a predicate is bool with the lanes of the access");
  }
  void check_index(const Expr& e) { require(e.type().is_int_or_uint(), e, "indices are integers"); }
  void check_children(const Expr& e) {
    for_each_child(e, [&](const Expr& child) { check(child); });
  }

  // ---- statements ----
  void check_for(const Stmt& s, const For& n) {
    check(n.min);
    check(n.extent);
    require(n.min.type() == Int(32) && n.extent.type() == Int(32), s, "loop bounds are int32");
    const bool gone = n.runs == ForType::Vectorized || n.runs == ForType::Unrolled;
    require(phase_ != Phase::Vector || !gone, s,
            "no vectorized or unrolled loop is left in the phase Vector");
    require(!in_kernel_ || !is_gpu(n.runs), s, "a kernel has no loops over blocks and threads");
    const Binding binding(*this, n.name, s);
    check(n.body);
  }
  void check_launch(const Stmt& s, const Launch& n) {
    only_in_flat(s);
    require(!in_kernel_, s, "a kernel does not launch kernels");
    require(n.blocks.size() == 3 && n.threads.size() == 3, s, "grids and blocks have 3 dimensions");
    for (const Expr& count : n.blocks) {
      check(count);
      require(count.type() == Int(32), s, "a number of blocks is an int32");
    }
    check(n.shared_bytes);
    require(n.shared_bytes.type() == Int(32), s, "a number of bytes is an int32");
    in_kernel_ = true;
    {
      std::list<Binding> indices;
      for (int d = 0; d < 3; ++d) {
        indices.emplace_back(*this, thread_index(n.name, d), s);
        indices.emplace_back(*this, block_index(n.name, d), s);
      }
      check(n.body);
    }
    in_kernel_ = false;
  }
  void check_store(const Stmt& s, const Store& n) {
    only_in_flat(s);
    check(n.value);
    check(n.index);
    check_index(n.index);
    require(n.value.type().lanes() == n.index.type().lanes(), s,
            "a store's value has the lanes of its index");
    check_predicate(s, n.predicate, n.index.type().lanes());
    check_storage(n.name, s);
  }
  void check_provide(const Stmt& s, const Provide& n) {
    only_in_loops(s);
    int lanes = 1;
    for (const Expr& value : n.values) {
      check(value);
      lanes = std::max(lanes, value.type().lanes());
    }
    for (const Expr& arg : n.args) {
      check(arg);
      check_index(arg);
      lanes = std::max(lanes, arg.type().lanes());
    }
    require(!n.values.empty(), s, "a Provide has values");
    check_predicate(s, n.predicate, lanes);
  }
  void check_realize(const Stmt& s, const Realize& n) {
    only_in_loops(s);
    require(!n.types.empty(), s, "a Realize has types");
    check_bounds(s, n.bounds);
    check_layout(s, n);
    // Metadata of the storage, which flattening gives values.
    std::vector<std::string> facts;
    for (size_t d = 0; d < n.bounds.size(); d++) {
      for (const char* what : {".min.", ".extent.", ".stride."})
        facts.push_back(n.name + what + std::to_string(d));
    }
    visible_.insert(facts.begin(), facts.end());
    check(n.body);
    for (const std::string& fact : facts) visible_.erase(fact);
    checked_.clear();
  }
  void check_layout(const Stmt& s, const Realize& n) {
    const auto check_integer = [&](const Expr& e) {
      if (!e.defined()) return;
      check(e);
      require(e.type() == Int(32), s, "folds and the first element of a Realize are int32");
    };
    std::ranges::for_each(n.layout.folds, check_integer);
    check_integer(n.layout.first);
    std::vector<int> order = n.layout.order;
    std::ranges::sort(order);
    for (size_t d = 0; d < order.size(); d++)
      require(order[d] == static_cast<int>(d) && order.size() == n.bounds.size(), s,
              "the order of a Realize names each dimension once");
  }
  void check_allocate(const Stmt& s, const Allocate& n) {
    only_in_flat(s);
    check(n.elements);
    require(n.elements.type() == Int(64), s, "the size of an Allocate is an int64");
    require(n.type.is_scalar(), s, "an Allocate holds scalars");
    check_offset(s, n);
    if (!allocated_.insert(n.name).second)
      fail(s, "names are unique: two allocations are called " + quoted(n.name));
    live_.insert(n.name);
    check(n.body);
    live_.erase(n.name);
    checked_.clear();
  }
  void check_offset(const Stmt& s, const Allocate& n) {
    const bool has_place = in_kernel_ && n.memory == MemoryType::GPUShared;
    require(n.offset.defined() == has_place, s,
            "an Allocate has an offset exactly if it lies in the shared memory of a kernel");
    if (!has_place) return;
    check(n.offset);
    require(n.offset.type() == Int(32), s, "an offset is an int32");
  }
  void check_free(const Stmt& s, const Free& n) {
    only_in_flat(s);
    require(live_.erase(n.name) > 0, s, "a Free ends an allocation that is alive");
    checked_.clear();  // loads checked before are invalid from now on
  }
  void check_bounds(const Stmt& s, const std::vector<Range>& bounds) {
    for (const Range& r : bounds) {
      check(r.min);
      check(r.extent);
      require(r.min.type() == Int(32) && r.extent.type() == Int(32), s,
              "bounds of a Realize are int32");
    }
  }
  // A Free in one branch ends the allocation for everything after both branches.
  void check_branches(const IfThenElse& n) {
    const auto before = live_;
    check(n.when_true);
    const auto after_then = std::exchange(live_, before);
    checked_.clear();
    check(n.when_false);
    std::erase_if(live_, [&](const std::string& name) { return !after_then.count(name); });
  }
  void check_scalar_bool(const Expr& condition, const Stmt& s) {
    check(condition);
    require(condition.type() == Bool(), s, "conditions are scalar bool");
  }
  template <class Tree>
  void check_storage(const std::string& name, const Tree& node) {
    if (allocated_.count(name) && !live_.count(name)) {
      fail(node, "an allocation is used inside its Allocate and before its Free: " + quoted(name) +
                     " is not alive");
    }
  }
  template <class Tree>
  void only_in_loops(const Tree& node) {
    if (phase_ > Phase::Loops)
      fail(node, std::string(kind_name(node.kind())) + " belongs to the phase Loops");
  }
  template <class Tree>
  void only_in_flat(const Tree& node) {
    if (phase_ <= Phase::Loops)
      fail(node, std::string(kind_name(node.kind())) + " belongs to the phase FlatStorage");
  }

  bool in_kernel_ = false;
  const Stmt& before_;
  const Phase phase_;
  const std::string pass_;
  std::unordered_set<std::string> visible_, bound_;
  std::unordered_set<const ExprNode*> checked_;
  std::unordered_set<Expr, StructuralHash, StructuralEqual> lets_;
  std::unordered_set<std::string> allocated_,
      live_;  // names of all allocations so far; those alive here
};

}  // namespace

void validate(const Stmt& s, Phase phase, const std::string& after_pass,
              const std::vector<std::string>& free_names, const Stmt& before) {
  Validator(before, phase, after_pass, free_names).check(s);
}

}  // namespace retrograde::ir
