// schedules.cpp -- schedules operators according to the worker's last argument. Retrograde uses its default schedule,
// or options of its autoscheduler ("without=strips"). Halide uses one of its autoschedulers, or a schedule by hand with
// everything at root.
#include "../gradients/gradient.h"

namespace kernels {

#ifdef BENCH_RETROGRADE

// A search runs here, so that it is timed, and again during compilation, with the same result.
void schedule(Pipeline& pipeline, const Setup& setup) {
  const auto options = retrograde::AutoscheduleOptions::from_string(setup.schedule);
  pipeline.set_autoschedule(options);
  if (options.search) pipeline.explain_schedule(setup.target);
}

#else

namespace {

// Boundary conditions stay inlined.
bool is_boundary(const Func& f) {
  for (const char* each : {"repeat_edge", "constant_exterior", "repeat_image", "mirror"}) {
    if (f.name().rfind(each, 0) == 0 && !f.has_update_definition()) return true;
  }
  return false;
}

// Calls `parallel` on the fusion of all of them.
template <typename Stages>
void parallel_all(Stages& stage, const std::vector<Var>& vars) {
  if (vars.empty()) return;
  Var all = vars[0];
  for (size_t i = 1; i < vars.size(); i++) {
    Var fused;
    stage.fuse(all, vars[i], fused);
    all = fused;
  }
  stage.parallel(all);
}

// The Func's variables that an update does not change, innermost first.
std::vector<Var> pure_vars(const Func& f, int update) {
  std::vector<Var> pure;
  const std::vector<Expr> args = f.update_args(update);
  for (size_t d = 0; d < args.size(); d++) {
    const auto* variable = args[d].as<Internal::Variable>();
    if (variable && variable->name == f.args()[d].name()) pure.push_back(f.args()[d]);
  }
  return pure;
}

// The number of terms, from constant extents; unknown extents count as one.
double terms_of(const Func& f, int update) {
  double terms = 1;
  for (const Internal::ReductionVariable& r : f.function().update(update).schedule().rvars()) {
    const auto* extent = Internal::simplify(r.extent).as<Internal::IntImm>();
    terms *= extent ? static_cast<double>(extent->value) : 1;
  }
  return terms;
}

constexpr double many_terms =
    16384;  // from this many terms on, a sum is a vector of partial sums along its first variable

void schedule_sum(Func& f, int update, int lanes);

// Splits a long sum with one result: one partial sum for each slice of its last variable, in parallel.
void schedule_slices(Func& f, int update, int lanes) {
  const std::vector<RVar> rvars = f.rvars(update);
  Var slice("slice");
  Func slices = f.update(update).rfactor(rvars[rvars.size() > 2 ? 1 : rvars.size() - 1], slice);
  slices.compute_root().parallel(slice);
  schedule_sum(slices, 0, lanes);
}

void schedule_sum(Func& f, int update, int lanes) {
  const std::vector<RVar> rvars = f.rvars(update);
  const std::vector<Var> pure = pure_vars(f, update);
  if (pure.empty() && f.dimensions() == 0 && rvars.size() > 1)
    return schedule_slices(f, update, lanes);
  Stage stage = f.update(update);
  if (pure.size() == static_cast<size_t>(f.dimensions()))
    stage.atomic().vectorize(rvars[0], lanes, TailStrategy::GuardWithIf);
  parallel_all(stage, pure);
}

void schedule_update(Func& f, int update, int lanes) {
  if (terms_of(f, update) >= many_terms) return schedule_sum(f, update, lanes);
  std::vector<Var> pure = pure_vars(f, update);
  if (pure.empty()) return;
  Stage stage = f.update(update);
  if (pure[0].name() == f.args()[0].name()) {
    stage.vectorize(pure[0], lanes, TailStrategy::GuardWithIf);
    pure.erase(pure.begin());
  }
  parallel_all(stage, pure);
}

// A first schedule by hand: every Func at root, vectorized along its rows, with rows in parallel.
void by_hand(Pipeline& pipeline, const Setup& setup) {
  const int lanes = setup.lanes<float>();
  std::vector<Internal::Function> outputs;
  for (const Func& output : pipeline.outputs()) outputs.push_back(output.function());
  for (const auto& [name, function] : Internal::build_environment(outputs)) {
    Func f(function);
    if (is_boundary(f)) continue;
    f.compute_root();
    std::vector<Var> vars = f.args();
    if (!vars.empty()) {
      f.vectorize(vars[0], lanes, TailStrategy::GuardWithIf);
      vars.erase(vars.begin());
      parallel_all(f, vars);
    }
    for (int update = 0; update < f.num_update_definitions(); update++)
      schedule_update(f, update, lanes);
  }
}

}  // namespace

// The plugins have the autoschedulers' names in lower case.
void schedule(Pipeline& pipeline, const Setup& setup) {
  if (setup.schedule == "root") return by_hand(pipeline, setup);
  std::string plugin = setup.schedule;
  for (char& c : plugin) c = static_cast<char>(std::tolower(c));
  load_plugin(std::string(BENCH_HALIDE_PLUGINS) + "/libautoschedule_" + plugin + ".so");
  pipeline.apply_autoscheduler(setup.target,
                               {setup.schedule, {{"parallelism", std::to_string(setup.threads)}}});
}

#endif

}  // namespace kernels
