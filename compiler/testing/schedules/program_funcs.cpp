#include "testing/schedules/program_funcs.h"

#include <algorithm>
#include <map>

#include "graph/directives/directive.h"
#include "graph/directives/wrappers.h"
#include "graph/names.h"
#include "ir/visit.h"

namespace retrograde::fuzz {

using namespace graph;

namespace {

std::string name_without_numbers(const FuncContents& f) { return without_numbers(f.name); }

}  // namespace

ProgramFuncs::ProgramFuncs(const RandomProgram& program, const ScheduleLog& log)
    : program_(&program), outputs_(apply_wrappers(with_log(log, fuzz::outputs_of(program)))) {
  std::set<std::string> known;
  for (const Func& f : program.funcs) known.insert(name_without_numbers(*f.function()));
  for (const ScheduleLog::Entry& entry : log.entries) known.insert(made_by(entry.directive));
  std::map<std::string, int> alike;  // Funcs with equal names, which a log cannot distinguish
  const std::vector<FuncPtr> all = topological_order(outputs_);
  for (const FuncPtr& f : all) ++alike[name_without_numbers(*f)];
  for (const FuncPtr& f : all) {
    const std::string name = name_without_numbers(*f);
    if (known.count(name) && alike[name] == 1) funcs_.push_back(f);
  }
}

std::string ProgramFuncs::name(int f) const { return name_without_numbers(func(f)); }

bool ProgramFuncs::is_output(int f) const {
  return std::ranges::find(outputs_, funcs_[f]) != outputs_.end();
}

std::vector<oracle::Region> ProgramFuncs::regions_of(int f) const {
  std::vector<oracle::Region> regions;
  for (size_t o = 0; o < program_->outputs.size(); ++o) {
    if (name_without_numbers(*program_->outputs[o].function()) != name(f)) continue;
    for (const auto& run : program_->runs) regions.push_back(run[o]);
  }
  return regions;
}

void ProgramFuncs::for_each_read(int f, int stage, const Visit& visit) const {
  Seen seen;
  visit_reads(func(f), stage, visit, true, seen);
}

void ProgramFuncs::visit_reads(const FuncContents& f, int stage, const Visit& visit, bool direct,
                               Seen& seen) const {
  walk(f.stage(stage), [&](const ir::Call& call) {
    if (call.symbol.raw() == &f) return;
    if (call.call_type == ir::CallType::Image) visit(-1, call, direct);
    if (call.call_type != ir::CallType::Func) return;
    const FuncPtr callee = func_of(call);
    const auto known = std::ranges::find(funcs_, callee);
    if (known != funcs_.end()) {
      visit(static_cast<int>(known - funcs_.begin()), call, direct);
    } else if (seen.insert(callee.get()).second) {
      for (int s = 0; s < callee->stage_count(); ++s) visit_reads(*callee, s, visit, false, seen);
    }
  });
}

int ProgramFuncs::reads_of(int f) const {
  int reads = 1;
  for (int s = 0; s < stages(f); ++s) {
    for_each_read(f, s, [&](int p, const ir::Call&, bool) { reads += p >= 0; });
  }
  return reads;
}

std::set<int> ProgramFuncs::producers_of_stage(int f, int stage) const {
  std::set<int> producers;
  for_each_read(f, stage, [&](int p, const ir::Call&, bool) {
    if (p >= 0) producers.insert(p);
  });
  return producers;
}

std::set<int> ProgramFuncs::producers_of(int f) const {
  std::set<int> producers;
  for (int s = 0; s < stages(f); ++s) producers.merge(producers_of_stage(f, s));
  return producers;
}

bool ProgramFuncs::depends(int f, int on) const {
  return std::ranges::any_of(producers_of(f),
                             [&](const int p) { return p == on || depends(p, on); });
}

std::vector<int> ProgramFuncs::direct_consumers_of(int f) const {
  std::vector<int> consumers;
  for (int g = 0; g < count(); ++g) {
    const auto callees = direct_callees(func(g));
    if (std::ranges::find(callees, funcs_[f]) != callees.end()) consumers.push_back(g);
  }
  return consumers;
}

std::vector<int> ProgramFuncs::consumers_first() const {
  std::vector<int> order, waiting(count(), 0);
  for (int f = 0; f < count(); ++f) {
    for (const int p : producers_of(f)) ++waiting[p];
  }
  for (int f = count() - 1; f >= 0; --f) {
    if (waiting[f] == 0) order.push_back(f);
  }
  for (size_t i = 0; i < order.size(); ++i) {
    for (const int p : producers_of(order[i])) {
      if (--waiting[p] == 0) order.push_back(p);
    }
  }
  return order;
}

bool ProgramFuncs::read_image_parameters() const {
  const auto parameters = parameters_of({funcs_.begin(), funcs_.end()});
  return std::ranges::any_of(parameters,
                             [](const auto& p) { return p->is_buffer && !p->is_literal; });
}

}  // namespace retrograde::fuzz
