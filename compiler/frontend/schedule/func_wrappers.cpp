// func_wrappers.cpp -- Func::in, clone_in and copy_input, and copies between host and device.
#include <algorithm>

#include "frontend/language/func.h"
#include "graph/directives/wrappers.h"
#include "ir/equal.h"

namespace retrograde {

Func Func::wrap(const std::vector<Func>& users, const std::string& name, bool clone) const {
  return Func(graph::wrapper_of(
      func_, ir::mapped(users, [](const Func& user) -> graph::FuncPtr { return user.function(); }),
      name, clone));
}

Func Func::in(const Func& f) { return wrap({f}, name() + "_in_" + f.name(), false); }
Func Func::in() { return wrap({}, name() + "_global_wrapper", false); }
Func Func::clone_in(const Func& f) { return wrap({f}, name() + "_clone_in_" + f.name(), true); }

Func Func::copy_input(const ImageParam& image) { return copied(image.parameter()); }
Func Func::copy_input(const Buffer<>& image) { return copied(image.parameter()); }
Func Func::copied(const std::shared_ptr<graph::ParameterContents>& image) const {
  if (!image)
    user_error("copy an input for " + quoted(name()), "an input has a type and dimensions",
               "this one was not constructed so", "Construct it: ImageParam in(Float(32), 2)");
  return Func(graph::copied_input(func_, image, image->name + "_in_" + name()));
}

Func Func::in(const std::vector<Func>& fs) {
  if (fs.empty()) {
    user_error("wrap " + quoted(name()), "at least one user is named", "the list is empty",
               "Call in() for all users");
  }
  return wrap(fs, name() + "_wrapper", false);
}

Func Func::clone_in(const std::vector<Func>& fs) {
  if (fs.empty())
    user_error("clone " + quoted(name()), "at least one user is named", "the list is empty",
               "Name the Funcs that read it, or leave the list out");
  return wrap(fs, name() + "_clone", true);
}

Func Func::copy_to_device(DeviceAPI) {
  unsupported("copy " + quoted(name()) + " to a device", "storage lies in the memory of the CPU",
              "kernels copy the data that they need by themselves", "Leave it out");
}

// Whether the definition is f(x, y) = g(x, y).
static bool is_plain_copy(const graph::FuncContents& f) {
  if (!f.pure || f.is_extern() || !f.updates.empty() || f.pure->values.size() != 1) return false;
  const ir::Call* read = f.pure->values[0].as<ir::Call>();
  if (!read || (read->call_type != ir::CallType::Func && read->call_type != ir::CallType::Image)) {
    return false;
  }
  return std::ranges::equal(read->args, f.pure->args,
                            [](const Expr& a, const Expr& b) { return ir::equal(a, b); });
}

Func Func::copy_to_host() {
  if (!is_plain_copy(*func_)) {
    user_error("copy " + quoted(name()) + " to the host",
               "a copy has the same values at the same coordinates",
               defined() ? text("its definition is another one") : text("it has no definition"),
               "Copy a wrapper: " + name() + ".in().copy_to_host()");
  }
  return *this;
}

}  // namespace retrograde
