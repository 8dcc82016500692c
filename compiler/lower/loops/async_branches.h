// async_branches.h -- splits the code around an async Func into the branches of a Fork, for fork_async.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "ir/expr.h"
#include "lower/loops/semaphores.h"
#include "lower/program.h"

namespace retrograde::lower {

using FuncNames = std::set<std::string>;

// Whether the statement uses the Func, and whether an expression directly in it does.
bool uses_func(const Stmt& s, const std::string& func);
bool own_parts_use(const Stmt& s, const std::string& func);

// The statement as the producer of a Func; null if it is another statement.
const ProducerConsumer* as_producer(const Stmt& s);
bool produces(const Stmt& s, const std::string& func);
// Whether a loop inside of `s` is around the producer.
bool has_loop_around(const Stmt& s, const std::string& func);
// The Funcs computed together in the loops of a producer (compute_with): those of producers nested directly in each
// other, without a loop in between. Tracing may stand around the inner ones.
FuncNames fused_funcs_of(const ProducerConsumer& producer);

// The hoisted storage outside of the statement that holds its Funcs, by original names.
FuncNames hoisted_places_of(const Stmt& s, const Program& program);

[[noreturn]] void refuse_async_loops(const std::string& func, const std::string& evidence,
                                     const char* instead);

// The producer's branch has only the work of the producer and the Funcs it needs; the consumer's branch has everything
// else. Undefined if empty.
struct AsyncBranches {
  Stmt producer, consumer;
};
// Splits the code inside the storage `n` of an async Func. `room`: how many iterations the producer may be ahead
// (StorageLayout::lead); nullopt: it runs once. `forked`: the async Funcs whose Forks are around this code.
AsyncBranches split_branches(const Realize& n, std::optional<int> room,
                             const std::vector<std::string>& forked, const Program& program,
                             Semaphores& semaphores);

}  // namespace retrograde::lower
