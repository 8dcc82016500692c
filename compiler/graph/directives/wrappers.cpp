#include "graph/directives/wrappers.h"

#include <algorithm>
#include <set>
#include <unordered_set>

#include "diagnostics/error.h"
#include "graph/copy_graph.h"
#include "graph/definitions/define.h"
#include "graph/definitions/first_reads.h"
#include "graph/directives/give_directive.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {

namespace graph {

namespace {

bool is_wrapper_of(const FuncContents* candidate, const FuncContents& f) {
  return std::ranges::any_of(f.wrappers,
                             [&](const auto& entry) { return entry.second.get() == candidate; });
}

// The Func that `user` reads for a reference to f, through wrappers of wrappers. Calls `visit` at
// each step. Wrappers of f read f itself.
const FuncContents* resolve(const FuncContents* f, const FuncContents& user,
                            FunctionRef<void(const FuncContents&)> visit) {
  while (f != &user && !is_wrapper_of(&user, *f)) {
    auto found = f->wrappers.find(user.name);
    if (found == f->wrappers.end()) found = f->wrappers.find("");
    if (found == f->wrappers.end()) break;
    visit(*f);
    f = found->second.get();
  }
  return f;
}

// The Func that `user` reads instead of an image. Null when it reads the image itself, as that Func
// and its copies do.
FuncPtr reader_of_image(const Call& call, const FuncContents& user) {
  const auto* image = static_cast<const ParameterContents*>(call.symbol.raw());
  if (const FuncPtr* copy = find_or_null(user.copied_inputs, image->name)) return *copy;
  return !image->func || image->func->name == user.name ? nullptr : image->func;
}

class Wrapping {
 public:
  std::vector<FuncPtr> apply(const std::vector<FuncPtr>& outputs) {
    const auto result =
        mapped(outputs, [&](const FuncPtr& output) { return copy_of(output.get()); });
    for (size_t i = 0; i < queue_.size(); i++) redirect(*queue_[i]);
    check_used();
    for (const FuncContents* f : queue_) {
      copies_[f]->wrappers.clear();
      copies_[f]->copied_inputs.clear();
    }
    for (const FuncContents* f : queue_) redirect_prefetches(*copies_[f], copies_);
    return result;
  }

 private:
  FuncCopies copies_;
  std::vector<const FuncContents*> queue_;
  std::set<std::pair<const FuncContents*, std::string>>
      used_;  // pairs of a Func and the consumer it is wrapped in

  const FuncPtr& copy_of(const FuncContents* f) {
    FuncPtr& copy = copies_[f];
    if (!copy) {
      copy = std::make_shared<FuncContents>(*f);
      queue_.push_back(f);
    }
    return copy;
  }

  FuncPtr read_by(const FuncContents* f, const FuncContents& user) {
    return copy_of(resolve(f, user, [&](const FuncContents& step) {
      used_.insert({&step, user.name});
    }));
  }

  void redirect(const FuncContents& f) {
    const FuncPtr copy = copies_[&f];
    for (int s = 0; s < f.stage_count(); s++) {
      Definition changed = map_exprs(f.stage(s), [&](const Expr& e) { return redirect(e, f); });
      copy->stage(s) = std::move(changed);
    }
    if (!f.extern_definition) return;
    for (ExternArgument& arg : copy->extern_definition->args) {
      if (arg.kind == ExternArgument::Kind::Func) arg.func = read_by(arg.func.get(), f);
    }
  }

  Expr redirect(const Expr& root, const FuncContents& f) {
    return rewrite(root, [&](const Expr& e, const auto& recurse) {
      const Expr mapped = map_children(e, recurse);
      const Call* call = mapped.as<Call>();
      if (!call) return mapped;
      const FuncContents* target = nullptr;
      if (call->call_type == CallType::Func)
        target = static_cast<const FuncContents*>(call->symbol.raw());
      if (call->call_type == CallType::Image) target = reader_of_image(*call, f).get();
      if (!target && is_weak_read(*call)) return owning_read(*call, call->args);
      if (!target) return mapped;
      const FuncPtr callee = read_by(target, f);
      const bool self = target == &f;
      return call_func(callee->name, call->type, call->args, call->component,
                       self ? SymbolRef::weak(callee) : SymbolRef(callee));
    });
  }

  void check_used() const {
    std::unordered_set<std::string> names;
    for (const FuncContents* f : queue_) names.insert(f->name);
    for (const FuncContents* f : queue_) {
      for (const auto& [user, wrapper] : f->wrappers) {
        if (user.empty() || !names.count(user) || used_.count({f, user})) continue;
        user_error(text("wrap ", quoted(f->name), " in ", quoted(user)),
                   "a Func is wrapped in the Funcs that read it",
                   text("nothing in ", quoted(user), " reads ", quoted(f->name)),
                   "Name a Func that reads it, or leave the wrapper out");
      }
    }
  }
};

// The Funcs that f reads instead of images.
std::vector<FuncPtr> image_readers(const FuncContents& f) {
  std::vector<FuncPtr> readers;
  for (const Call* call : first_reads(f)) {
    if (call->call_type != CallType::Image) continue;
    const FuncPtr reader = reader_of_image(*call, f);
    if (reader && std::ranges::find(readers, reader) == readers.end()) readers.push_back(reader);
  }
  return readers;
}

bool is_scheduled(const FuncContents& reader) {
  return reader.schedule.is_given || !reader.wrappers.empty() || reader.pure->schedule.is_given;
}

}  // namespace

FuncPtr clone_of(const FuncPtr& f, const std::string& name) {
  FuncPtr clone = std::make_shared<FuncContents>(*f);
  clone->name = claim_name(name);
  clone->wrappers.clear();
  clone->copied_inputs.clear();
  clone->log.clear();  // the clone's log starts empty, with the schedule so far as its base
  clone->outputs.clear();
  make_outputs(*clone);
  for (int s = 1; s < f->stage_count(); s++) {
    clone->stage(s) =
        map_exprs(f->stage(s), [&](const Expr& e) { return redirect_calls(e, f, clone, true); });
  }
  return clone;
}

std::vector<FuncPtr> apply_wrappers(const std::vector<FuncPtr>& outputs) {
  for (const FuncPtr& f : topological_order(outputs)) {
    const auto readers = image_readers(*f);
    if (!f->wrappers.empty() || !f->copied_inputs.empty() ||
        std::ranges::any_of(readers, [](const FuncPtr& r) { return is_scheduled(*r); })) {
      return Wrapping().apply(outputs);
    }
  }
  return outputs;
}

std::vector<FuncPtr> functions_of(const std::vector<FuncPtr>& outputs) {
  std::vector<FuncPtr> found = topological_order(outputs);
  std::unordered_set<const FuncContents*> seen;
  for (const FuncPtr& f : found) seen.insert(f.get());
  const auto add = [&](const FuncPtr& root) {
    if (seen.count(root.get())) return;
    for (const FuncPtr& f : topological_order({root})) {
      if (seen.insert(f.get()).second) found.push_back(f);
    }
  };
  for (size_t i = 0; i < found.size(); i++) {
    const FuncPtr f = found[i];
    for (const auto& entry : f->wrappers) add(entry.second);
    for (const auto& entry : f->copied_inputs) add(entry.second);
    for (const FuncPtr& reader : image_readers(*f)) add(reader);
  }
  return found;
}

namespace {

// A handle that keeps `owner` alive as long as `f` is used.
template <typename Owner>
FuncPtr owning(std::shared_ptr<Owner> owner, FuncPtr f) {
  struct Both {
    std::shared_ptr<Owner> owner;
    FuncPtr func;
  };
  FuncContents* contents = f.get();
  return FuncPtr(std::make_shared<Both>(Both{std::move(owner), std::move(f)}), contents);
}

// w(args) = f(args)
FuncPtr identity_of(const FuncPtr& f, const std::string& name) {
  auto wrapper = std::make_shared<FuncContents>();
  wrapper->name = claim_name(name);
  std::vector<Expr> args = variables_of(f->args), values;
  for (size_t i = 0; i < f->types.size(); i++) {
    values.push_back(
        call_func(f->name, f->types[i], args, static_cast<int>(i), SymbolRef::weak(f)));
  }
  define_pure(wrapper, args, values);
  return wrapper;
}

bool is_identity(const FuncContents& wrapper, const FuncContents& f) {
  const Call* call = wrapper.is_extern() ? nullptr : wrapper.pure->values[0].as<Call>();
  return wrapper.updates.empty() && call && call->symbol.raw() == &f;
}

std::string names_of(const std::vector<std::string>& users) { return listed(users, quoted); }

bool reads(const FuncContents& user, const FuncContents& f) {
  bool found = false;
  const auto visit = [&](const FuncContents& step) { found = found || &step == &f; };
  const auto follow = [&](const FuncContents& callee) {
    if (resolve(&callee, user, visit) == &f) found = true;
  };
  for (const FuncPtr& callee : direct_callees(user)) follow(*callee);
  for (const FuncPtr& reader : image_readers(user)) follow(*reader);
  return found;
}

// 1. f has a definition. 2. It is not wrapped in itself. 3. Every completed user reads it.
void check_users(const FuncPtr& f, const std::vector<FuncPtr>& users, const std::string& asked) {
  if (!f->is_defined())
    user_error(asked, quoted(f->name) + " needs a definition first", "it has none", "Define it");
  for (const FuncPtr& user : users) {
    if (user.get() == f.get()) {
      user_error(asked, "a Func is wrapped in the Funcs that read it",
                 quoted(f->name) + " is wrapped in itself", "Name one of its users");
    }
    if (!user->frozen || reads(*user, *f)) continue;
    user_error(asked, "a Func is wrapped in the Funcs that read it",
               text("nothing in ", quoted(user->name), " reads ", quoted(f->name)),
               "Name a Func that reads it");
  }
}

// Exactly `users` share this wrapper.
void check_shared(const FuncContents& f, const FuncPtr& wrapper,
                  const std::vector<std::string>& users, const std::string& asked) {
  std::vector<std::string> sharing;
  for (const auto& [user, other] : f.wrappers) {
    if (other == wrapper) sharing.push_back(user);
  }
  std::vector<std::string> wanted = users;
  std::ranges::sort(wanted);
  if (wanted == sharing) return;
  user_error(asked, "Funcs that share a wrapper share it in every request",
             text(quoted(wrapper->name), " is the wrapper in ", names_of(sharing)),
             "Name these together, or use Funcs that have no wrapper yet");
}

}  // namespace

FuncPtr wrapper_of(const FuncPtr& handle, const std::vector<FuncPtr>& users,
                   const std::string& name, bool clone) {
  const FuncPtr f = handle->shared_from_this();
  auto keys = mapped(users, [](const FuncPtr& user) { return user->name; });
  if (users.empty()) keys.push_back("");
  const std::string asked =
      text(clone ? "clone " : "wrap ", quoted(f->name),
           users.empty() ? std::string(" for all its users") : " in " + names_of(keys));
  check_users(f, users, asked);
  const auto existing = f->wrappers.find(keys[0]);
  if (existing != f->wrappers.end()) {
    check_shared(*f, existing->second, keys, asked);
    if (clone == is_identity(*existing->second, *f)) {
      user_error(asked, "a user has either a wrapper or a clone",
                 text(quoted(existing->second->name), " exists already"), "Keep that one");
    }
    return owning(handle, existing->second);
  }
  for (const std::string& key : keys) {
    if (!f->wrappers.count(key)) continue;
    user_error(asked, "Funcs that share a wrapper share it in every request",
               text(quoted(key), " has the wrapper ", quoted(f->wrappers[key]->name), " and ",
                    quoted(keys[0]), " has none"),
               "Give each its own");
  }
  FuncPtr wrapper = clone ? clone_of(f, name) : identity_of(f, name);
  f->frozen = wrapper->frozen = true;  // wrappers never change values
  for (const std::string& key : keys) f->wrappers[key] = wrapper;
  const auto named = mapped(users, [](const FuncPtr& user) { return NamedFunc(user->name); });
  log_directive(
      {f}, clone ? Directive(Clone{wrapper->name, named}) : Directive(Wrap{wrapper->name, named}));
  return owning(handle, wrapper);
}

namespace {

// reader(_0, _1) = image(_0, _1)
FuncPtr reader_of(const std::shared_ptr<ParameterContents>& image, const std::string& name,
                  const SymbolRef& symbol) {
  auto reader = std::make_shared<FuncContents>();
  reader->name = claim_name(name);
  const std::vector<Expr> args = variables_of(implicit_names(image->dimensions));
  define_pure(reader, args, {call_image(image->name, image->type, args, symbol)});
  reader->frozen = true;
  return reader;
}

bool reads_image(const FuncContents& f, const std::string& image) {
  bool found = false;
  walk(f,
       [&](const Call& call) { found |= call.call_type == CallType::Image && call.name == image; });
  return found;
}

}  // namespace

FuncPtr copied_input(const FuncPtr& handle, const std::shared_ptr<ParameterContents>& image,
                     const std::string& name) {
  const FuncPtr user = handle->shared_from_this();
  const std::string asked =
      text("copy the input ", quoted(image->name), " for ", quoted(user->name));
  if (!user->is_defined() || user->is_extern() || !reads_image(*user, image->name))
    user_error(asked, "an input is copied for a Func that reads it",
               text("no definition of ", quoted(user->name), " reads ", quoted(image->name)),
               "Name an image that it reads");
  FuncPtr& copy = user->copied_inputs[image->name];
  if (!copy) {
    copy = reader_of(image, name, SymbolRef(image));
    user->frozen = true;  // its reads are final
    log_directive({user}, CopyInput{copy->name, image->name});
  }
  return owning(handle, copy);
}

FuncPtr func_of_image(const std::shared_ptr<ParameterContents>& image) {
  if (!image->func) {
    image->func = reader_of(image, image->name + "_im", SymbolRef::weak(image));
    image->func->required_types = {image->type};
    image->func->required_dimensions = image->dimensions;
    image->version++;
  }
  return owning(image, image->func);
}

}  // namespace graph

}  // namespace retrograde
