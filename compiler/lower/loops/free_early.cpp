// free_early -- end the life of an allocation right after its last use.
// In:  FlatStorage or Vector; names unique.
// Out: the same phase, with a Free after the last statement that uses an allocation; at most one on every path.
//
//   allocate a[n] {                    allocate a[n] {
//     for ... { a[..] = .. }             for ... { a[..] = .. }
//     allocate b[n] {                    allocate b[n] {
//       for ... { b[..] = a[..] }  =>      for ... { b[..] = a[..] }
//       for ... { out[..] = b[..] }        free a
//     }                                    for ... { out[..] = b[..] }
//   }                                      free b
//                                        }
//                                      }
//
// Method: a region is the straight-line code in the body of the function, of a loop or of a branch, looking through
//         lets, allocations, producers and blocks. Its steps are the remaining statements: loops, stores, branches.
//         One walk numbers the steps and notes the last one that uses each allocation of the region; a second
//         walk inserts the Frees. Both are linear, however deep the allocations nest.
// Not done: allocations that are never used; moving an allocation to its first use.
// Source: folklore. Tests: test/golden/lower/free_early/.
#include "lower/statement_passes.h"

#include <unordered_map>
#include <utility>
#include <vector>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

// Whether a region's straight-line code continues inside the statement.
bool is_transparent(const Stmt& s) {
  return s.kind() == Kind::LetStmt || s.kind() == Kind::ProducerConsumer ||
         s.kind() == Kind::Allocate || s.kind() == Kind::Block;
}

// The number of a statement in the order of execution; one node may occur in several places.
using Place = size_t;

struct LastUses {
  std::unordered_map<Place, std::vector<std::string>>
      frees;  // allocations to free after the statement at a place
};

// Visits statements in the order of execution.
class LastUseFinder {
 public:
  LastUses find(const Stmt& s) {
    visit_region(s);
    LastUses result;
    for (const std::string& name :
         allocations_) {  // inner allocations come last and are freed first
      const Life& life = lives_.at(name);
      if (life.is_used && !life.is_freed) result.frees[life.last_step].push_back(name);
    }
    return result;
  }

 private:
  struct Life {
    size_t region;
    Place last_step = 0;
    bool is_used = false;
    bool is_freed = false;  // the program already has a Free
  };

  void visit_region(const Stmt& s) {
    steps_.push_back(next_);
    visit(s);
    steps_.pop_back();
  }

  void visit(const Stmt& s) {
    if (!s.defined()) return;
    Place place = next_++;
    bool is_step = !is_transparent(s);
    if (is_step) steps_.back() = place;
    if (const Allocate* a = s.as<Allocate>()) {
      allocations_.push_back(a->name);
      lives_[a->name] = {steps_.size() - 1};
    }
    if (const Free* free = s.as<Free>()) lives_[free->name].is_freed = true;
    if (const Store* store = s.as<Store>()) use(store->name);
    for_each_child(
        s, [&](const Expr& e) { visit(e, is_step ? steps_.back() : place); },
        [&](const Stmt& child) { is_step ? visit_region(child) : visit(child); });
  }

  // Loads in the value of a let run before the let's body, so the step is the let itself.
  void visit(const Expr& e, Place place) {
    Place step = std::exchange(steps_.back(), place);
    walk(e, [&](const Load& load) { use(load.name); });
    steps_.back() = step;
  }

  void use(const std::string& name) {
    auto it = lives_.find(name);
    if (it == lives_.end()) return;
    it->second.last_step = steps_[it->second.region];
    it->second.is_used = true;
  }

  Place next_ = 0;
  std::vector<Place> steps_;  // the current step of each region, outermost first
  std::vector<std::string> allocations_;
  std::unordered_map<std::string, Life> lives_;
};

}  // namespace

Stmt free_early(const Stmt& s) {
  if (!s.defined()) return s;
  const LastUses uses = LastUseFinder().find(s);
  if (uses.frees.empty()) return s;
  Place next = 0;
  return rewrite_statements(s, [&](const Stmt& node, auto& all) {
    const auto here = uses.frees.find(next++);
    if (here == uses.frees.end()) return all.children(node);
    std::vector<Stmt> frees;
    for (size_t i = here->second.size(); i-- > 0;) frees.push_back(make_free(here->second[i]));
    if (const LetStmt* let =
            node.as<LetStmt>()) {  // the let's value is the last use: free before the body
      frees.push_back(all(let->body));
      return make_let(let->name, let->value, make_block(std::move(frees)));
    }
    if (const Allocate* a = node.as<Allocate>()) {
      frees.push_back(all(a->body));
      return make_allocate(a->name, a->type, a->memory, a->elements, make_block(std::move(frees)),
                           a->offset);
    }
    frees.insert(frees.begin(), all.children(node));
    return make_block(std::move(frees));
  });
}

}  // namespace retrograde::lower
