#include "lower/device/device_buffers.h"

#include <set>

#include "ir/build.h"
#include "ir/lists.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/runtime_call.h"
#include "retrograde_runtime.h"

namespace retrograde::lower {

namespace {

using Names = std::set<std::string>;  // sorted, so that the generated code is deterministic

bool has_launch(const Stmt& s) {
  return any_stmt(s, [](const Stmt& part) { return part.kind() == Kind::Launch; });
}

Names accessed_by_kernels(const Stmt& s) {
  Names names, inside;
  walk(s, [&](const Launch& launch) {
    walk(
        launch.body, [&](const Load& n) { names.insert(n.name); },
        [&](const Store& n) { names.insert(n.name); },
        [&](const Allocate& n) { inside.insert(n.name); });
  });
  for (const std::string& name : inside) names.erase(name);
  return names;
}

Expr buffer_of(const std::string& name) { return variable(name + ".buffer", Handle()); }

class TransferInserter {
 public:
  TransferInserter(const Stmt& s, const GivenBuffers& given)
      : fresh_(s), given_(given), on_device_(accessed_by_kernels(s)) {
    on_device_.insert(given.names.begin(), given.names.end());
  }

  Stmt visit(const Stmt& s) {
    if (!s.defined() || s.kind() == Kind::Launch) return s;
    if (const auto* allocation = s.as<Allocate>()) return with_buffer(*allocation);
    if (!has_launch(s)) return on_host(s);
    if (const auto* let = s.as<LetStmt>()) {
      std::vector<Stmt> all = copies_to_host(accesses(let->value));
      all.push_back(make_let(let->name, let->value, visit(let->body)));
      return make_block(std::move(all));
    }
    if (s.kind() == Kind::Block) return inside(s);
    if (const auto* mark = s.as<ProducerConsumer>())
      return mark->produces ? overwriting(mark->name, inside(s)) : inside(s);
    Accesses own;
    for_each_child(
        s, [&](const Expr& e) { add(own, accesses(e)); }, [](const Stmt&) {});
    std::vector<Stmt> all = copies_to_host(own);
    all.push_back(inside(s));
    return make_block(std::move(all));
  }

 private:
  Stmt inside(const Stmt& s) {
    return map_children(s, [&](const Stmt& part) { return visit(part); });
  }

  Stmt overwriting(const std::string& func, Stmt production) {
    for (const std::string& name : value_or(given_.overwritten, func, std::vector<std::string>())) {
      std::vector<Expr> others;
      for (const std::string& other : given_.names) {
        if (other != name) others.push_back(buffer_of(other));
      }
      const auto count = static_cast<int>(others.size());
      const std::string mark = fresh_(name + ".overwritten");
      const Expr begun = call_runtime(
          "retrograde_overwrite_begin",
          {buffer_of(name), count, others.empty() ? null_handle() : pack(std::move(others))},
          Handle());
      const Expr ended = call_runtime("retrograde_overwrite_end", {variable(mark, Handle())});
      production = make_let(mark, begun, make_block({production, make_evaluate(ended)}));
    }
    return production;
  }

  struct Accesses {
    Names reads, writes;
  };
  static void add(Accesses& to, const Accesses& from) {
    to.reads.insert(from.reads.begin(), from.reads.end());
    to.writes.insert(from.writes.begin(), from.writes.end());
  }

  // A function that is passed an address may read and store there.
  template <class Tree>
  Accesses accesses(const Tree& tree) const {
    Accesses found;
    const auto on_load = [&](const Load& n) {
      if (on_device_.count(n.name)) found.reads.insert(n.name);
    };
    const auto on_call = [&](const Call& n) {
      if (!n.is_op(Op::address_of)) return;
      if (const auto* load = n.args[0].template as<Load>(); load && on_device_.count(load->name))
        found.writes.insert(load->name);
    };
    if constexpr (std::is_same_v<Tree, Stmt>) {
      walk(tree, on_load, on_call, [&](const Store& n) {
        if (on_device_.count(n.name)) found.writes.insert(n.name);
      });
    } else {
      walk(tree, on_load, on_call);
    }
    return found;
  }

  Stmt with_buffer(const Allocate& n) {
    const bool is_on_device = on_device_.count(n.name) > 0;
    Stmt body = visit(n.body);
    if (is_on_device) {
      const Expr first =
          call_op(Op::address_of, Handle(), {make_load(n.type, n.name, Expr(0), {}, {})});
      const Expr type = make_uint_const(UInt(32), static_cast<uint64_t>(n.type.code()) |
                                                      (static_cast<uint64_t>(n.type.bits()) << 8) |
                                                      (uint64_t{1} << 16));
      const std::string buffer = n.name + ".buffer";
      Stmt done = make_evaluate(call_runtime("retrograde_device_buffer_free", {buffer_of(n.name)}));
      body = make_let(buffer,
                      call_runtime("retrograde_device_buffer", {first, n.elements, type}, Handle()),
                      make_block({make_assert(reinterpret_as(UInt(64), buffer_of(n.name)) !=
                                                  make_uint_const(UInt(64), 0),
                                              int32_t{retrograde_error_out_of_memory}),
                                  body, done}));
    }
    return make_allocate(n.name, n.type, n.memory, n.elements, body, n.offset);
  }

  std::vector<Stmt> copies_to_host(const Accesses& accesses) {
    Names names = accesses.reads;
    names.insert(accesses.writes.begin(), accesses.writes.end());
    std::vector<Stmt> calls;
    for (const std::string& name : names) {
      calls.push_back(checked_call(fresh_(name + ".to_host"),
                                   call_runtime("retrograde_to_host", {buffer_of(name)})));
    }
    return calls;
  }

  Stmt on_host(const Stmt& s) {
    const Accesses here = accesses(s);
    if (here.reads.empty() && here.writes.empty()) return s;
    std::vector<Stmt> all = copies_to_host(here);
    all.push_back(s);
    for (const std::string& name : here.writes)
      all.push_back(make_evaluate(call_runtime("retrograde_host_changed", {buffer_of(name)})));
    return make_block(std::move(all));
  }

  FreshNames fresh_;
  const GivenBuffers& given_;
  Names on_device_;
};

}  // namespace

Stmt insert_device_transfers(const Stmt& s, const GivenBuffers& given) {
  return TransferInserter(s, given).visit(s);
}

}  // namespace retrograde::lower
