// Checks the rules of each phase in one walk over the statement. The rules of expressions lie in validate_expr.cpp.
#include "ir/validate.h"

#include <algorithm>
#include <list>

#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/phase_check.h"
#include "ir/validate_expr.h"
#include "ir/validate_scope.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

class StmtValidator {
 public:
  StmtValidator(const PhaseCheck& phase, const std::vector<std::string>& free_names)
      : phase_(phase), scope_(phase, free_names), exprs_(phase, scope_) {}

  void check(const Stmt& s) {
    if (!s.defined()) return;
    match(
        s,
        [&](const LetStmt& n) {
          check(n.value);
          const Binding binding(scope_, n.name, s);
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
          scope_.check_branches([&] { check(n.when_true); }, [&] { check(n.when_false); });
        },
        [&](const Evaluate& n) { check(n.value); }, [&](const Atomic& n) { check(n.body); },
        [&](const Fork& n) {
          check(n.first);
          check(n.rest);
        },
        [&](const Prefetch& n) {
          phase_.only_in_loops(s);
          check_bounds(s, n.bounds);
        },
        [&](const Launch& n) { check_launch(s, n); }, [](const StmtNode&) {});
  }

 private:
  using Binding = ValidationScope::Binding;

  void check(const Expr& e) { exprs_.check(e); }
  void require(bool holds, const Stmt& s, const char* rule) const {
    phase_.require(holds, s, rule);
  }

  void check_for(const Stmt& s, const For& n) {
    check(n.min);
    check(n.extent);
    require(n.min.type() == Int(32) && n.extent.type() == Int(32), s, "loop bounds are int32");
    const bool gone = n.runs == ForType::Vectorized || n.runs == ForType::Unrolled;
    require(phase_.phase() != Phase::Vector || !gone, s,
            "no vectorized or unrolled loop is left in the phase Vector");
    require(!in_kernel_ || !is_gpu(n.runs), s, "a kernel has no loops over blocks and threads");
    const Binding binding(scope_, n.name, s);
    check(n.body);
  }
  void check_launch(const Stmt& s, const Launch& n) {
    phase_.only_in_flat(s);
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
        indices.emplace_back(scope_, thread_index(n.name, d), s);
        indices.emplace_back(scope_, block_index(n.name, d), s);
      }
      check(n.body);
    }
    in_kernel_ = false;
  }
  void check_store(const Stmt& s, const Store& n) {
    phase_.only_in_flat(s);
    check(n.value);
    check(n.index);
    exprs_.check_index(n.index);
    require(n.value.type().lanes() == n.index.type().lanes(), s,
            "a store's value has the lanes of its index");
    exprs_.check_predicate(s, n.predicate, n.index.type().lanes());
    scope_.check_alive(n.name, s);
  }
  void check_provide(const Stmt& s, const Provide& n) {
    phase_.only_in_loops(s);
    int lanes = 1;
    for (const Expr& value : n.values) {
      check(value);
      lanes = std::max(lanes, value.type().lanes());
    }
    for (const Expr& arg : n.args) {
      check(arg);
      exprs_.check_index(arg);
      lanes = std::max(lanes, arg.type().lanes());
    }
    require(!n.values.empty(), s, "a Provide has values");
    exprs_.check_predicate(s, n.predicate, lanes);
  }
  void check_realize(const Stmt& s, const Realize& n) {
    phase_.only_in_loops(s);
    require(!n.types.empty(), s, "a Realize has types");
    check_bounds(s, n.bounds);
    check_layout(s, n);
    const auto names = metadata_names(n.name, n.bounds.size());  // flattening binds them
    scope_.show(names);
    check(n.body);
    scope_.hide(names);
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
    phase_.only_in_flat(s);
    check(n.elements);
    require(n.elements.type() == Int(64), s, "the size of an Allocate is an int64");
    require(n.type.is_scalar(), s, "an Allocate holds scalars");
    check_offset(s, n);
    scope_.begin_allocation(n.name, s);
    check(n.body);
    scope_.end_allocation(n.name);
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
    phase_.only_in_flat(s);
    require(scope_.end_allocation(n.name), s, "a Free ends an allocation that is alive");
  }
  void check_bounds(const Stmt& s, const std::vector<Range>& bounds) {
    for (const Range& r : bounds) {
      check(r.min);
      check(r.extent);
      require(r.min.type() == Int(32) && r.extent.type() == Int(32), s,
              "bounds of a Realize are int32");
    }
  }
  void check_scalar_bool(const Expr& condition, const Stmt& s) {
    check(condition);
    require(condition.type() == Bool(), s, "conditions are scalar bool");
  }

  const PhaseCheck& phase_;
  ValidationScope scope_;
  ExprValidator exprs_;
  bool in_kernel_ = false;
};

}  // namespace

void validate(const Stmt& s, Phase phase, const std::string& after_pass,
              const std::vector<std::string>& free_names, const Stmt& before) {
  const PhaseCheck check(phase, after_pass, before);
  StmtValidator(check, free_names).check(s);
}

}  // namespace retrograde::ir
