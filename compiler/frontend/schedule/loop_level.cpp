// loop_level.cpp -- LoopLevel, the handle of a place to compute or store a Func.
#include "frontend/schedule/loop_level.h"

#include "frontend/language/func.h"

namespace retrograde {

LoopLevel::LoopLevel() : contents_(std::make_shared<graph::LoopLevelContents>()) {}

LoopLevel::LoopLevel(graph::LoopLevel level) : LoopLevel() {
  contents_->level = std::move(level);
  contents_->defined = true;
}

LoopLevel::LoopLevel(const Func& f, const VarOrRVar& var, int stage_index)
    : LoopLevel(graph::LoopLevel{graph::LoopLevel::Kind::At, f.name(), var.name(), stage_index}) {}

LoopLevel LoopLevel::inlined() { return LoopLevel(graph::LoopLevel{}); }

LoopLevel LoopLevel::root() {
  return LoopLevel(graph::LoopLevel{graph::LoopLevel::Kind::Root, "", "", -1});
}

void LoopLevel::set(const LoopLevel& other) {
  const std::string asked = "set a loop level to " + quoted(other.to_string());
  if (contents_->locked) {
    user_error(asked, "a locked level does not change", "lock() was called on it",
               "Set it before it is locked");
  }
  contents_->level = other.level();
  contents_->defined = true;
  for (const auto& follow : contents_->followers) follow(contents_->level);
}

LoopLevel& LoopLevel::lock() {
  level();
  contents_->locked = true;
  return *this;
}

const graph::LoopLevel& LoopLevel::level() const {
  if (!contents_->defined) {
    user_error("use a loop level", "a level is a loop, root or inlined",
               "it was made without a loop and never set", "Set it: level.set(LoopLevel(f, x))");
  }
  return contents_->level;
}

const graph::LoopLevel& LoopLevel::loop(const char* asked) const {
  if (level().kind != graph::LoopLevel::Kind::At)
    user_error(asked, "the level is a loop of a Func", "it is " + quoted(to_string()),
               "Ask is_root() and is_inlined() first");
  return level();
}

std::string LoopLevel::func() const { return loop("take the Func of a loop level").func; }
VarOrRVar LoopLevel::var() const {
  const std::string& name = loop("take the variable of a loop level").var;
  return VarOrRVar(name, name.find('.') != std::string::npos);
}
int LoopLevel::stage_index() const { return loop("take the stage of a loop level").stage; }

std::string LoopLevel::to_string() const {
  switch (level().kind) {
    case graph::LoopLevel::Kind::Inlined:
      return "inlined";
    case graph::LoopLevel::Kind::Root:
      return "root";
    case graph::LoopLevel::Kind::At:
      return level().func + "." + level().var;
  }
  internal_error("a loop level of unknown kind");
}

}  // namespace retrograde
