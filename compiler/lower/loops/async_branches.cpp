#include "lower/loops/async_branches.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"

namespace retrograde::lower {

namespace {

// Whether the expression (or statement) itself reads (or writes) the Func.
bool reads_func(const Expr& e, const std::string& func) {
  const Call* call = e.as<Call>();
  const Variable* variable = e.as<Variable>();
  const auto name = variable ? parse_metadata_name(variable->name) : std::nullopt;
  return (call && call->call_type == CallType::Func && call->name == func) ||
         (name && name->buffer == func && name->what == Metadata::Stride);
}

bool writes_func(const Stmt& s, const std::string& func) {
  const Provide* provide = s.as<Provide>();
  const Prefetch* prefetch = s.as<Prefetch>();
  return (provide && provide->name == func) || (prefetch && prefetch->name == func);
}

}  // namespace

bool uses_func(const Stmt& s, const std::string& func) {
  return any_node(
      s, [&](const Expr& node) { return reads_func(node, func); },
      [&](const Stmt& part) { return writes_func(part, func); });
}

bool own_parts_use(const Stmt& s, const std::string& func) {
  bool found = false;
  for_each_child(
      s,
      [&](const Expr& e) {
        found = found || any_node(e, [&](const Expr& node) { return reads_func(node, func); });
      },
      [](const Stmt&) {});
  return found;
}

const ProducerConsumer* as_producer(const Stmt& s) {
  const ProducerConsumer* n = s.as<ProducerConsumer>();
  return n && n->produces ? n : nullptr;
}

namespace {

bool is_producer_of(const Stmt& s, const std::string& func) {
  const ProducerConsumer* n = as_producer(s);
  return n && n->name == func;
}

bool produces_any(const Stmt& s, const FuncNames& funcs) {
  return any_stmt(s, [&](const Stmt& part) {
    const ProducerConsumer* n = as_producer(part);
    return n && funcs.count(n->name);
  });
}

}  // namespace

bool produces(const Stmt& s, const std::string& func) { return produces_any(s, {func}); }

namespace {

void add_group(const Stmt& s, FuncNames& names) {
  if (const auto* let = s.as<LetStmt>()) return add_group(let->body, names);
  if (const auto* block = s.as<Block>()) {
    for (const Stmt& part : block->stmts) add_group(part, names);
  } else if (const ProducerConsumer* n = as_producer(s)) {
    names.insert(n->name);
    add_group(n->body, names);
  }
}

}  // namespace

FuncNames fused_funcs_of(const ProducerConsumer& producer) {
  FuncNames names = {producer.name};
  add_group(producer.body, names);
  return names;
}

namespace {

FuncNames realized_in(const Stmt& s) {
  FuncNames names;
  walk(s, [&](const Realize& n) { names.insert(n.name); });
  return names;
}

FuncNames produced_in(const Stmt& s) {
  FuncNames names;
  walk(s, [&](const ProducerConsumer& n) {
    if (n.produces) names.insert(n.name);
  });
  return names;
}

// Whether anything except the computation of the Func itself uses it.
bool is_read_outside(const Stmt& s, const std::string& func) {
  bool found = false;
  walk(
      s, [&](const Expr& e) { return !(found = found || reads_func(e, func)); },
      [&](const Stmt& part) {
        return !is_producer_of(part, func) && !(found = found || writes_func(part, func));
      });
  return found;
}

}  // namespace

bool has_loop_around(const Stmt& s, const std::string& func) {
  bool found = false;
  walk(
      s, [](const Expr&) { return false; },
      [&](const Stmt& part) {
        if (is_producer_of(part, func)) return false;
        found |= part.kind() == Kind::For && produces(part, func);
        return !found;
      });
  return found;
}

namespace {

// Whether anything uses this Func, or one that is computed together with it.
bool is_group_read(const Stmt& s, const std::string& func) {
  FuncNames group = {func};
  walk(
      s, [](const Expr&) { return false; },
      [&](const Stmt& part) {
        const ProducerConsumer* n = as_producer(part);
        const FuncNames names = n ? fused_funcs_of(*n) : FuncNames();
        if (names.count(func)) group.insert(names.begin(), names.end());
        return !names.count(func);
      });
  return std::any_of(group.begin(), group.end(),
                     [&](const std::string& other) { return is_read_outside(s, other); });
}

}  // namespace

FuncNames hoisted_places_of(const Stmt& s, const Program& program) {
  FuncNames places, inside;
  if (!s.defined()) return places;
  for (const std::string& name : realized_in(s)) inside.insert(original_name(name));
  for (const std::string& name : inside) {
    const LoopedFunc* f = program.find(name);
    if (f && is_hoisted(*f) && !inside.count(place_name(name))) places.insert(place_name(name));
  }
  return places;
}

namespace {

// Whether the statement uses the Func, or the hoisted storage, that was realized under this name.
bool needs(const Stmt& s, const std::string& name, const Program& program) {
  return s.defined() &&
         (uses_func(s, name) || hoisted_places_of(s, program).count(original_name(name)));
}

}  // namespace

[[noreturn]] void refuse_async_loops(const std::string& func, const std::string& evidence,
                                     const char* instead) {
  unsupported(
      text("compute ", quoted(func), " async"),
      "the loops between storage and computation of an async Func are serial and always run",
      evidence, instead);
}

namespace {

class BranchSplitter {
 public:
  BranchSplitter(const Realize& n, std::optional<int> room, const std::vector<std::string>& forked,
                 const Program& program, Semaphores& semaphores)
      : n_(n), room_(room), forked_(forked), program_(program), semaphores_(semaphores) {}

  AsyncBranches split() {
    in_producer_branch_ = {n_.name};
    producer = only_producer(n_.body);
    while (add_producers_of_producer()) producer = only_producer(n_.body);
    in_producer_branch_.erase(n_.name);
    consumer = without_unread(without_producer(n_.body, n_.name), in_producer_branch_);
    check_is_apart();
    return {producer, consumer};
  }

 private:
  // Adds Funcs computed in the same loops that the producer reads; false if there are no more.
  bool add_producers_of_producer() {
    const size_t before = in_producer_branch_.size();
    walk(
        n_.body, [](const Expr&) { return false; },
        [&](const Stmt& part) {
          const ProducerConsumer* other = as_producer(part);
          if (!other || (other->name != n_.name && produces(part, n_.name))) return true;
          const FuncNames group = fused_funcs_of(*other);
          if (std::any_of(group.begin(), group.end(),
                          [&](const std::string& func) { return uses_func(producer, func); }))
            in_producer_branch_.insert(group.begin(), group.end());
          return false;
        });
    return in_producer_branch_.size() > before;
  }

  // Removes the computation of those Funcs that nothing reads.
  Stmt without_unread(Stmt s, FuncNames funcs) {
    for (auto it = funcs.begin(); s.defined() && it != funcs.end();) {
      if (!produces(s, *it) || is_group_read(s, *it)) {
        ++it;
        continue;
      }
      s = without_producer(s, *it);
      funcs.erase(it);
      it = funcs.begin();
    }
    return s;
  }

  // Both branches may compute a Func, in its own loops or fused with another, only if each has storage for it.
  void check_is_apart() const {
    const std::string name = quoted(original_name(n_.name));
    const FuncNames inside = realized_in(n_.body);
    FuncNames computed = produced_in(producer);
    computed.insert(in_producer_branch_.begin(), in_producer_branch_.end());
    computed.erase(n_.name);
    for (const std::string& other : computed) {
      const LoopedFunc* f = program_.find(other);
      const bool is_output = f && f->is_output && is_read_outside(producer, other);
      if (inside.count(other) || (!is_output && !produces(consumer, other))) continue;
      user_error(text("compute ", name, " async"),
                 "what an async Func and its consumer both read is stored no further out than the "
                 "async Func, or computed outside of the loops that they share",
                 text(quoted(original_name(other)),
                      " is computed in these loops and stored around ", name),
                 text("Compute ", quoted(original_name(other)), " at root, store it where ", name,
                      " is stored, or call async() on it"));
    }
  }

  // The loop around a branch's part of its body. The innermost loop around the producer gets the branch's wait and
  // signal.
  Stmt around_loop(const For& n, Stmt body, bool of_producer) {
    if (room_ && produces(n.body, n_.name) && !has_loop_around(n.body, n_.name)) {
      const Semaphore before = of_producer ? Space : Ready, after = of_producer ? Ready : Space;
      std::vector<Stmt> stmts;
      if (before == Ready || *room_ > 0) stmts.push_back(semaphores_.acquire(n_.name, before));
      if (body.defined()) stmts.push_back(body);
      if (after == Ready || *room_ > 0) stmts.push_back(Semaphores::release(n_.name, after));
      body = make_block(std::move(stmts));
    }
    return make_for(n.name, n.min, n.extent, n.runs, body, n.partition);
  }

  // The statement with each part replaced; undefined if no part is left.
  Stmt around(const Stmt& s, FunctionRef<Stmt(const Stmt&)> part) const {
    const Stmt result = map_children(s, part);
    const Realize* n = result.defined() ? result.as<Realize>() : nullptr;
    return n && !needs(n->body, n->name, program_) ? n->body : result;
  }

  // Whether the statement checks a condition on the schedule or on sizes; neighbouring code relies on such checks.
  static bool is_check(const Stmt& s) {
    const auto* check = s.defined() ? s.as<Assert>() : nullptr;
    return check && !reads_memory(check->condition, MemoryReads::Storage);
  }

  // Keeps only the work of the producer and of the Funcs that it needs, with the control flow around; undefined if
  // nothing is left.
  Stmt only_producer(const Stmt& s) {
    if (!s.defined() || !produces_any(s, in_producer_branch_)) return {};
    if (const ProducerConsumer* n = as_producer(s); n && in_producer_branch_.count(n->name))
      return s;
    const auto part = [&](const Stmt& child) { return only_producer(child); };
    if (const Block* n = s.as<Block>()) {
      const auto is_wait = [&](const Stmt& child) {
        return std::any_of(forked_.begin(), forked_.end(), [&](const std::string& func) {
          return Semaphores::is_step(child, func);
        });
      };
      std::vector<Stmt> stmts;
      for (const Stmt& child : n->stmts) {
        const bool stays = is_wait(child) || is_check(child);
        stmts.push_back(stays ? child : part(child));
      }
      return make_block(std::move(stmts));
    }
    if (const For* n = s.as<For>()) {
      if (n->runs != ForType::Serial && produces(n->body, n_.name)) {
        refuse_async_loops(original_name(n_.name),
                           text("the loop ", describe_loop(n->name), " is not serial"),
                           "Store the Func inside of that loop");
      }
      return around_loop(*n, part(n->body), true);
    }
    if (const ProducerConsumer* n = s.as<ProducerConsumer>()) return part(n->body);
    return around(s, part);
  }

  // Keeps everything except the work of a Func's producer.
  Stmt without_producer(const Stmt& s, const std::string& func) {
    if (!s.defined() || !produces(s, func)) return s;
    if (is_producer_of(s, func)) return {};
    const auto part = [&](const Stmt& child) { return without_producer(child, func); };
    const For* n = s.as<For>();
    if (n && func == n_.name) return around_loop(*n, part(n->body), false);
    return around(s, part);
  }

  const Realize& n_;
  const std::optional<int> room_;
  const std::vector<std::string>& forked_;
  const Program& program_;
  Semaphores& semaphores_;
  Stmt producer, consumer;
  FuncNames in_producer_branch_;  // computed by the producer's branch
};

}  // namespace

AsyncBranches split_branches(const Realize& n, std::optional<int> room,
                             const std::vector<std::string>& forked, const Program& program,
                             Semaphores& semaphores) {
  return BranchSplitter(n, room, forked, program, semaphores).split();
}

}  // namespace retrograde::lower
