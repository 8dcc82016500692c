// find_grid -- turn the loops over blocks of a kernel into its grid.
//
//   gpu_block for (f.s0.y, 2, n) {             launch f.kernel blocks(m, n, 1) {
//     let a = f.s0.y * 8                  =>     let f.s0.y = f.kernel.block.y + 2
//     gpu_block for (f.s0.x, 0, m) {             let a = f.s0.y * 8
//       body                                     let f.s0.x = f.kernel.block.x
//     }                                          body
//   }                                          }
//
// The innermost loop is x. Only lets and producer/consumer marks may stand between the loops.
#include "diagnostics/error.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/device/kernel.h"
#include "lower/nests/copy_statement.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

bool has_threads(const Stmt& s) {
  return any_node(s, [](const For& loop) { return is_gpu_thread(loop.runs); });
}

int thread_depth(const Stmt& s) {
  int most = 0;
  const auto* loop = s.as<For>();
  if (!has_threads(s)) return 0;
  for_each_child(
      s, [](const Expr&) {}, [&](const Stmt& part) { most = std::max(most, thread_depth(part)); });
  return most + (loop && is_gpu_thread(loop->runs) ? 1 : 0);
}

namespace {

constexpr size_t most_loops = 3;

// Collects the loops over blocks, outermost first, and the lets between them.
class GridFinder {
 public:
  GridFinder(const std::string& name, const For& outermost) : name_(name), outermost_(outermost) {}

  Kernel find() {
    collect(outermost_);
    if (loops_.size() > most_loops) {
      refuse("a grid has at most three dimensions",
             text("there are ", loops_.size(), " loops over blocks in each other"),
             "Fuse two of them, or keep one serial");
    }
    Kernel kernel;
    kernel.name = name_;
    kernel.blocks.assign(most_loops, Expr(1));
    for (size_t d = 0; d < loops_.size(); ++d) {
      const For& loop = *loops_[loops_.size() - 1 - d];
      kernel.blocks[d] = count_of(loop);
    }
    kernel.body = inside(outermost_);
    return kernel;
  }

 private:
  [[noreturn]] void refuse(const std::string& rule, const std::string& evidence,
                           const std::string& instead) const {
    user_error("run GPU blocks of " + describe_loop(outermost_.name), rule, evidence, instead);
  }

  static bool is_grid_loop(const Stmt& s) {
    const auto* loop = s.as<For>();
    return loop && loop->runs == ForType::GpuBlock;
  }

  void collect(const For& loop) {
    loops_.push_back(&loop);
    const auto in_it = [](const For& n) { return n.runs == ForType::GpuBlock; };
    if (any_node(loop.body, in_it)) collect_next(loop.body);
  }

  void collect_next(const Stmt& s) {
    if (const auto* let = s.as<LetStmt>()) {
      lets_[let->name] = let->value;
      return collect_next(let->body);
    }
    if (const auto* mark = s.as<ProducerConsumer>()) return collect_next(mark->body);
    if (is_grid_loop(s)) return collect(*s.as<For>());
    const auto* allocation = s.as<Allocate>();
    refuse("nothing is computed between loops over blocks",
           allocation ? text(quoted(allocation->name), " is computed between them")
                      : std::string("a loop or a condition stands between them"),
           "Reorder the loops over blocks next to each other, and compute Funcs inside of them");
  }

  // The number of blocks, as an expression that is known before the kernel runs.
  Expr count_of(const For& loop) const {
    Expr count = loop.extent;
    for (bool changed = true; changed;) {
      Expr next = substitute(count, lets_);
      changed = !next.same_as(count);
      count = next;
    }
    for (const For* other : loops_) {
      if (!uses_variable(count, other->name)) continue;
      refuse("the number of blocks is known before the kernel starts",
             text("that of ", describe_loop(loop.name), " depends on ", describe_loop(other->name)),
             "Keep one of the loops serial");
    }
    return simplify(max(count, 0));
  }

  Stmt inside(const For& loop) const {
    const auto place = std::find(loops_.begin(), loops_.end(), &loop);
    const auto dimension = static_cast<int>(loops_.end() - place) - 1;
    const Expr index = loop.min + variable(block_index(name_, dimension));
    return make_let(loop.name, index, rest(loop.body));
  }

  Stmt rest(const Stmt& s) const {
    if (is_grid_loop(s)) return inside(*s.as<For>());
    if (const auto* let = s.as<LetStmt>()) return make_let(let->name, let->value, rest(let->body));
    if (const auto* mark = s.as<ProducerConsumer>())
      return make_producer_consumer(mark->name, mark->produces, rest(mark->body));
    return s;
  }

  const std::string& name_;
  const For& outermost_;
  std::vector<const For*> loops_;
  Substitution lets_;
};

}  // namespace

Kernel find_grid(const std::string& name, const For& outermost) {
  return GridFinder(name, outermost).find();
}

}  // namespace retrograde::lower
