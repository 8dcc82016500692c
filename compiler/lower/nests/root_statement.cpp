#include "lower/nests/root_statement.h"

#include "diagnostics/error.h"
#include "ir/buffer_metadata.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::lower {

namespace {

Expr unbounded() { return call_op(Op::undef, Int(32), {}); }
Expr side_or_unbounded(const Expr& side) { return side.defined() ? side : unbounded(); }
Expr bounded_side(const Expr& side) { return is_undef(side) ? Expr() : side; }

Stmt region_statement(const std::string& buffer, const Box& box) {
  std::vector<Expr> args{Expr(buffer)};
  for (const Interval& side : box) {
    args.push_back(side_or_unbounded(side.min));
    args.push_back(side_or_unbounded(side.max));
  }
  return make_evaluate(call_op(Op::buffer_region, Int(32), std::move(args)));
}

const Call* as_region(const Stmt& s) {
  const Evaluate* n = s.as<Evaluate>();
  return n ? as_op(n->value, Op::buffer_region) : nullptr;
}

}  // namespace

Stmt joined(const RootStatement& parts) {
  std::vector<Stmt> stmts;
  for (const auto& [buffer, box] : parts.regions) stmts.push_back(region_statement(buffer, box));
  stmts.push_back(parts.loops);
  return make_lets(parts.bounds, make_block(std::move(stmts)));
}

RootStatement split_root(const Stmt& s) {
  RootStatement parts;
  Stmt rest = s;
  for (const LetStmt* let = rest.as<LetStmt>(); let; let = rest.as<LetStmt>()) {
    parts.bounds.emplace_back(let->name, let->value);
    rest = let->body;
  }
  const Block* block = rest.as<Block>();
  const std::vector<Stmt> stmts = block ? block->stmts : std::vector<Stmt>{rest};
  std::vector<Stmt> loops;
  for (const Stmt& stmt : stmts) {
    const Call* region = as_region(stmt);
    if (!region) {
      loops.push_back(stmt);
      continue;
    }
    Box& box = parts.regions[region->args[0].as<StringImm>()->value];
    for (size_t i = 1; i + 1 < region->args.size(); i += 2)
      box.push_back({bounded_side(region->args[i]), bounded_side(region->args[i + 1])});
  }
  RETROGRADE_ASSERT(!parts.regions.empty(), "no buffer_region at the root of ", s);
  parts.loops = make_block(std::move(loops));
  return parts;
}

Box buffer_box(const std::string& buffer, int dimensions) {
  return numbered(dimensions, [&](int d) {
    const auto [min, extent] = metadata_range(buffer, d);
    return Interval{min, min + extent - 1};
  });
}

}  // namespace retrograde::lower
