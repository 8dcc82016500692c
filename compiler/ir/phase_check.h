// phase_check.h -- the phase that a program is checked against, and the error that blames a pass for a broken rule.
#pragma once

#include <string>
#include <utility>

#include "ir/expr.h"
#include "ir/print.h"
#include "ir/validate.h"

namespace retrograde::ir {

// Nodes are Exprs or Stmts.
class PhaseCheck {
 public:
  // `before`: the input of the pass, which the error shows; may be undefined.
  PhaseCheck(Phase phase, std::string pass, const Stmt& before)
      : phase_(phase), pass_(std::move(pass)), before_(before) {}

  Phase phase() const { return phase_; }
  // Throws InternalError with the rule that the node breaks.
  template <class Node>
  [[noreturn]] void fail(const Node& node, const std::string& rule) const {
    blame(rule, print(node));
  }
  template <class Node>
  void require(bool holds, const Node& node, const char* rule) const {
    if (!holds) fail(node, rule);
  }
  // Nodes of this kind belong to the phases up to Loops, or to those from FlatStorage on.
  template <class Node>
  void only_in_loops(const Node& node) const {
    if (phase_ > Phase::Loops)
      fail(node, std::string(kind_name(node.kind())) + " belongs to the phase Loops");
  }
  template <class Node>
  void only_in_flat(const Node& node) const {
    if (phase_ <= Phase::Loops)
      fail(node, std::string(kind_name(node.kind())) + " belongs to the phase FlatStorage");
  }

 private:
  [[noreturn]] void blame(const std::string& rule, const std::string& node) const;

  const Phase phase_;
  const std::string pass_;
  const Stmt& before_;
};

}  // namespace retrograde::ir
