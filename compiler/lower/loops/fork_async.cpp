// fork_async -- run async producers concurrently with their consumers.
// In:  Loops; names unique.
// Out: Loops; every async Func is computed in one branch of a Fork and consumed in the other.
//
//   realize f {                      realize f { realize f.semaphores {
//     produce f { P }                  fork { produce f { P }  release ready }
//     consume f { A; B(f) }      =>         { A; acquire ready; B(f) }
//   }                                } }
//
//   realize f { for y {              realize f { realize f.semaphores {
//     produce f { P(y) }               fork { for y { acquire space; P(y); release ready } }
//     consume f { B(f, y) }      =>         { for y { acquire ready; B(f, y); release space } }
//   } }                              } }
//
// Method: in the second form both branches keep the loops between storage level and compute level, each without the
//         other's work. `space` starts with the number of iterations that the producer may be ahead, which
//         build_loop_nests derives from the fold factor. It is left out if no element is overwritten while it is
//         still read.
//         Storage of several async Funcs nests, and so do the Forks: outermost first, each next Fork splits the branch
//         that consumes. If both parts read an outer async Func, each gets its own semaphores to that producer.
//         Other Funcs that the producer reads, and that are computed in the same loops, are computed in its branch.
//         They are computed in the other branch as well if that reads them or a Func computed with them (compute_with).
//         A Func with a ring buffer (ring_buffers.h) is forked around its hoisted storage: both branches share it, and
//         the producer may be ahead by the number of copies.
// Errors: a Func that both branches compute, if its storage level is outside of theirs; loops between storage and
//         compute level that are not serial, or that belong to a memoized Func.
// Source: Halide's documentation of async; the handshake is a bounded buffer's (Dijkstra 1965).
// Tests: test/golden/pipeline/fork_async/, test/unit/lower/async_test.cpp.
#include "lower/loops/fork_async.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/loops/async_branches.h"
#include "lower/loops/ring_buffers.h"
#include "lower/loops/semaphores.h"
#include "lower/nests/make_names_unique.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

class AsyncForker : public StatementRewriter {
 public:
  AsyncForker(const Stmt& s, const Program& program) : program_(program), semaphores_(s) {}

 protected:
  Stmt rewrite(const Stmt& original_stmt) override {
    const Stmt s = producers_outermost(original_stmt);
    const Realize* n = s.as<Realize>();
    if (n) around_[original_name(n->name)] = s;
    if (const Realize* func = n ? ring_at(*n) : nullptr) return fork_ring(*n, *func);
    if (!n || !is_async(n->name) || !produces(n->body, n->name)) return children(s);
    const Stmt body = has_loop_around(n->body, n->name) ? fork_loops(*n) : fork_once(*n);
    return with_body(*n, body);
  }

 private:
  const Program& program_;
  Semaphores semaphores_;
  std::vector<std::string>
      forked_;  // async Funcs whose consumer branch contains the current statement
  std::map<std::string, int>
      readers_;  // for each of those: the number of readers with their own semaphores
  std::map<std::string, Stmt> around_;  // Realizes by original name; the last one entered
  FuncNames rings_;                     // Funcs whose ring buffer is around and has been forked
  FuncNames shared_places_;             // their hoisted storage, which both branches share

  bool is_async(const std::string& name) const {
    const LoopedFunc* f = program_.find(name);
    return f && f->schedule.async && !rings_.count(f->name());
  }

  // The Realize of the async Func whose ring buffer is `place`; null if `place` is not such storage.
  const Realize* ring_at(const Realize& place) const {
    const std::string name = original_name(place.name);
    const LoopedFunc* f = program_.find(name.substr(0, name.rfind('.')));
    if (!f || !f->schedule.ring.defined() || !is_async(f->name()) || name != place_name(f->name()))
      return nullptr;
    const Realize* found = nullptr;
    int places = 0;
    walk(place.body, [&](const Realize& n) {
      if (original_name(n.name) != f->name()) return;
      found = &n;
      places++;
    });
    if (!found || !has_loop_around(place.body, found->name)) return nullptr;
    if (places > 1) refuse_ring(*f, text("it is computed at ", places, " places"));
    if (has_loop_around(found->body, found->name))
      refuse_ring(*f, "loops run between its storage and its computation");
    return found;
  }

  // Both branches realize the Func; the hoisted storage around provides the memory.
  Stmt fork_ring(const Realize& place, const Realize& func) {
    const LoopedFunc& f = *program_.find(func.name);
    const Stmt around = with_body(func, place.body);
    const Realize& whole = *around.as<Realize>();
    check_is_consumed(whole);
    const int room = copies_in_ring(f);
    rings_.insert(f.name());
    shared_places_.insert(original_name(place.name));
    const Stmt both = forked(whole, room, branches_of(whole, room));
    shared_places_.erase(original_name(place.name));
    rings_.erase(f.name());
    return with_body(place, both);
  }

  // Sorts directly nested Realizes: async Funcs come first, producers outside of their consumers. The others are then
  // inside of the Forks, where each branch can have its own.
  Stmt producers_outermost(const Stmt& s) const {
    std::vector<const Realize*> chain;
    for (const Realize* n = s.as<Realize>(); n; n = n->body.as<Realize>()) chain.push_back(n);
    if (chain.size() < 2) return s;
    const Stmt body = chain.back()->body;
    const auto position = [&](const Realize* n) {
      const auto it = program_.index_of.find(original_name(n->name));
      const bool is_func = it != program_.index_of.end();
      return std::pair(is_func && !is_async(n->name), is_func ? it->second : -1);
    };
    std::stable_sort(chain.begin(), chain.end(),
                     [&](const Realize* a, const Realize* b) { return position(a) < position(b); });
    Stmt result = body;
    for (size_t i = chain.size(); i-- > 0;) result = with_body(*chain[i], result);
    return result;
  }

  // ---- the two branches ----

  // `room`: nullopt if the producer runs once.
  AsyncBranches branches_of(const Realize& n, std::optional<int> room) {
    AsyncBranches branches = split_branches(n, room, forked_, program_, semaphores_);
    share_waits(branches.producer, branches.consumer);
    branches.producer = with_own_places(branches.producer, branches.consumer);
    return branches;
  }

  // Adds separate hoisted storage to the producer's branch if both branches would use the same one.
  Stmt with_own_places(Stmt producer, const Stmt& consumer) const {
    const FuncNames here = hoisted_places_of(producer, program_),
                    there = hoisted_places_of(consumer, program_);
    for (const std::string& place : here) {
      const auto around = around_.find(place);
      const bool is_shared = shared_places_.count(place) > 0;
      if (!there.count(place) || around == around_.end() || is_shared) continue;
      producer = with_body(*around->second.as<Realize>(), producer);
    }
    return producer;
  }

  Stmt forked(const Realize& n, int room, const AsyncBranches& branches) {
    readers_[n.name] = 1;
    forked_.push_back(n.name);
    const Stmt consumer = (*this)(branches.consumer);
    forked_.pop_back();
    const Stmt producer =
        semaphores_.for_readers((*this)(branches.producer), n.name, readers_.at(n.name));
    return Semaphores::around(make_fork(producer, consumer), n.name, room, readers_.at(n.name));
  }

  // ---- produced once ----

  Stmt fork_once(const Realize& n) {
    AsyncBranches branches = branches_of(n, std::nullopt);
    if (!branches.consumer.defined()) return children(n.body);
    branches.producer = make_block({branches.producer, Semaphores::release(n.name, Ready)});
    branches.consumer = acquired_late(branches.consumer, n.name);
    return forked(n, 0, branches);
  }

  // Whether the producer is memoized, and so does not run if the cache has its result.
  bool may_be_skipped(const ProducerConsumer& n) const {
    const LoopedFunc* f = program_.find(n.name);
    return n.produces && f && f->schedule.memoized;
  }

  // Inserts the wait as late as possible, after all code that does not need the Func.
  Stmt acquired_late(const Stmt& s, const std::string& func) {
    const ProducerConsumer* computation = s.as<ProducerConsumer>();
    const bool runs_body =
        computation ? !may_be_skipped(*computation) : s.as<LetStmt>() || s.as<Realize>();
    if (runs_body && !own_parts_use(s, func))
      return map_children(s, [&](const Stmt& body) { return acquired_late(body, func); });
    if (const Block* n = s.as<Block>()) {
      std::vector<Stmt> stmts = n->stmts;
      for (Stmt& part : stmts) {
        if (!uses_func(part, func)) continue;
        part = acquired_late(part, func);
        return make_block(std::move(stmts));
      }
    }
    return make_block({semaphores_.acquire(func, Ready), s});
  }

  // ---- produced in a loop ----

  // Rejects a memoized consumer: if the cache has its result, the branch that produces would wait for ever.
  void check_is_consumed(const Realize& n) const {
    walk(
        n.body, [](const Expr&) { return false; },
        [&](const Stmt& s) {
          const ProducerConsumer* around = as_producer(s);
          if (!around || !may_be_skipped(*around) || fused_funcs_of(*around).count(n.name) ||
              !produces(around->body, n.name))
            return true;
          refuse_async_loops(original_name(n.name),
                             text("they are those of ", quoted(original_name(around->name)),
                                  ", which is memoized"),
                             "Store the Func inside of that loop, or do not memoize the other");
        });
  }

  Stmt fork_loops(const Realize& n) {
    check_is_consumed(n);
    return forked(n, n.layout.lead, branches_of(n, n.layout.lead));
  }

  // The handshake of an outer async Func belongs to the branch that reads it. If both branches do, one gets semaphores
  // of its own: a wait in the other branch no longer orders the two.
  void share_waits(Stmt& producer, Stmt& consumer) {
    for (const std::string& outer : forked_) {
      const bool producer_waits = Semaphores::has_steps(producer, outer),
                 consumer_waits = consumer.defined() && Semaphores::has_steps(consumer, outer);
      if (!consumer.defined() || (!producer_waits && !consumer_waits)) continue;
      const bool in_producer = uses_func(producer, outer), in_consumer = uses_func(consumer, outer);
      if (in_producer && in_consumer) {
        Stmt& other = producer_waits && !consumer_waits ? consumer : producer;
        if (!producer_waits || !consumer_waits) other = acquired_late(other, outer);
        const int reader = readers_.at(outer)++;
        other = Semaphores::replace_steps(other, outer, [&](const Stmt& step) {
          return semaphores_.of_reader(step, outer, reader);
        });
      } else if (producer_waits && consumer_waits) {
        Stmt& other = in_producer ? consumer : producer;
        other =
            Semaphores::replace_steps(other, outer, [](const Stmt&) { return make_evaluate(0); });
      }
    }
  }
};

}  // namespace

Stmt fork_async(const Stmt& s, const Program& program) {
  const bool any = std::any_of(program.funcs.begin(), program.funcs.end(),
                               [](const LoopedFunc& f) { return f.schedule.async; });
  if (!any) return s;
  // Both branches contain copies of the loops around them, and may compute the same Func.
  return make_names_unique(AsyncForker(s, program)(s));
}

}  // namespace retrograde::lower
