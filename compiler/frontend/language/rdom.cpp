// rdom.cpp -- construction of reduction domains and their checks.
#include "frontend/language/rdom.h"

#include <ostream>

#include "frontend/data/image_param.h"
#include "ir/literal.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "simplify/cse.h"

namespace retrograde {

namespace {

const char* const variable_letters = "xyzw";

std::string variable_name(const std::string& domain, size_t i) {
  return i < 4 ? domain + "." + variable_letters[i] : domain + "." + std::to_string(i);
}

// Bounds are int32. They may depend on parameters, not on the pure variables of a definition.
Expr checked_bound(const Expr& e, const std::string& domain, const char* which) {
  const std::string asked = text("make the RDom ", quoted(domain));
  if (!e.defined())
    user_error(asked, text("its ", which, " must be a defined expression"), "it was never assigned",
               "Assign every Expr before it is used");
  if (!e.type().is_int_or_uint() || !e.type().is_scalar()) {
    user_error(asked, text("its ", which, " must be an integer"),
               text(e, " has type ", to_string(e.type())), "Convert it with cast<int>");
  }
  // Names that a Let binds are not variables of the program.
  walk(simplification::expand_lets(e), [&](const ir::Variable& v) {
    if (!v.symbol.defined() || graph::domain_of(v)) {
      user_error(asked, "its bounds must be known before any loop starts",
                 text("its ", which, " uses ", quoted(v.name)),
                 "Make the domain as large as it can get and leave points out with where()");
    }
  });
  return ir::int32_literal(e, asked);
}

void check_extent(const Expr& extent, const std::string& name) {
  auto constant = ir::as_const_int(extent);
  if (constant && *constant < 0) {
    user_error(text("make the RDom ", quoted(name)), "an extent is not negative",
               text("it is ", *constant), "Give 0 or more");
  }
}

}  // namespace

RVar::RVar() : name_(ir::unique_name("r")) {}

// Names of a domain's variables contain a dot: "r.x".
RVar::RVar(const std::string& name) : name_(name) {
  static_cast<void>(Var(name.substr(name.rfind('.') + 1)));
}

RVar::RVar(std::shared_ptr<graph::ReductionDomainContents> domain, int index)
    : name_(domain->vars.at(index).var), domain_(std::move(domain)), index_(index) {}

const graph::ReductionVariable& RVar::variable(const char* asked) const {
  if (!domain_) {
    user_error(text(asked, " of the RVar ", quoted(name_)),
               "only a variable of an RDom has a range", "it is a name for schedules",
               "Make an RDom and use its variables");
  }
  return domain_->vars[index_];
}

Expr RVar::min() const { return variable("take the min").min; }
Expr RVar::extent() const { return variable("take the extent").extent; }

RVar::operator Expr() const {
  variable("use the value");
  return ir::loose_variable(name_, Int(32), ir::SymbolRef(domain_));
}

RDom::RDom(const Region& region, const std::string& name) { initialize(region, name); }

RDom::RDom(const OutputImageParam& image) {
  Region region;
  for (int d = 0; d < image.dimensions(); d++)
    region.push_back({image.dim(d).min(), image.dim(d).extent()});
  initialize(region, "");
}

void RDom::initialize(const Region& region, const std::string& name) {
  const std::string unique = name.empty() ? ir::unique_name("r") : graph::claim_name(name);
  if (region.empty())
    user_error("make the RDom " + quoted(unique), "a reduction domain has at least one variable",
               "the region has no dimensions", "Give a min and an extent for each variable");
  domain_ = std::make_shared<graph::ReductionDomainContents>();
  for (size_t i = 0; i < region.size(); i++) {
    Expr min = checked_bound(region[i].min, unique, "min");
    Expr extent = checked_bound(region[i].extent, unique, "extent");
    check_extent(extent, unique);
    domain_->vars.push_back({variable_name(unique, i), std::move(min), std::move(extent)});
  }
  name_variables();
}

void RDom::name_variables() {
  RVar* const named[] = {&x, &y, &z, &w};
  for (int i = 0; i < dimensions() && i < 4; i++) *named[i] = RVar(domain_, i);
}

int RDom::dimensions() const { return domain_ ? static_cast<int>(domain_->vars.size()) : 0; }

RVar RDom::operator[](int i) const {
  if (i < 0 || i >= dimensions()) {
    user_error(text("take variable ", i, " of an RDom"), "variables are numbered from 0",
               text("it has ", dimensions(), " variables"), "Give a number below that");
  }
  return RVar(domain_, i);
}

const RVar RDom::only_variable() const {
  if (dimensions() != 1) {
    user_error("use an RDom as a variable",
               "only a domain of one variable converts to that variable",
               text("it has ", dimensions(), " variables"), "Name the variable: r.x, r.y or r[i]");
  }
  return RVar(domain_, 0);
}

RDom::operator RVar() const { return only_variable(); }
RDom::operator Expr() const { return only_variable(); }

void RDom::where(Expr predicate) {
  const std::string asked = "add a predicate to an RDom";
  if (!domain_)
    user_error(asked, "the RDom was given a domain", "it was constructed without bounds",
               "Construct it: RDom r(0, 10)");
  if (!predicate.defined())
    user_error(asked, "the predicate must be a defined expression", "it was never assigned",
               "Assign every Expr before it is used");
  if (domain_->frozen) {
    user_error(asked, "a predicate is given before the domain's first use in a definition",
               text("the domain of ", quoted(domain_->vars[0].var), " is in use"),
               "Call where() before the definition, or make another RDom");
  }
  if (!predicate.type().is_bool()) {
    user_error(asked, "a predicate is of type bool",
               text(predicate, " has type ", to_string(predicate.type())),
               "Compare it with something");
  }
  // Weak: the domain must not own itself through its predicate.
  predicate = graph::rebind_symbol(predicate, ir::SymbolRef::weak(domain_));
  domain_->predicate = domain_->predicate.defined() ? domain_->predicate && predicate : predicate;
}

std::ostream& operator<<(std::ostream& out, const RVar& var) { return out << var.name(); }

std::ostream& operator<<(std::ostream& out, const RDom& domain) {
  out << "RDom(";
  for (int i = 0; i < domain.dimensions(); i++) {
    out << (i ? ", " : "") << domain[i].name() << " in [" << domain[i].min() << ", +"
        << domain[i].extent() << ")";
  }
  return out << ")";
}

}  // namespace retrograde
