// minimize_ceres.cpp -- L-BFGS and non-linear conjugate gradients, by Ceres' gradient solver.
//
// The safeguard is its line search, which shortens steps whose value is not finite. If a line search fails although the
// run has made progress, the solver restarts from the best point with an empty memory: the usual cause is an outdated
// approximation of the Hessian.
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>
#include <glog/logging.h>

#include "common/minimize_run.h"

namespace apps {

namespace {

class CeresLoss : public ceres::FirstOrderFunction {
 public:
  explicit CeresLoss(MinimizeRun& run) : run_(run) {}

  bool Evaluate(const double* x, double* loss, double* gradient) const override {
    const size_t size = run_.problem().size;
    const std::span<double> g = gradient ? std::span(gradient, size) : std::span<double>();
    *loss = run_.evaluate({x, size}, g);
    return all_finite(*loss, g);
  }
  int NumParameters() const override { return static_cast<int>(run_.problem().size); }

 private:
  MinimizeRun& run_;
};

class CeresSteps : public ceres::IterationCallback {
 public:
  explicit CeresSteps(MinimizeRun& run) : run_(run) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    // Iteration 0 is the initial point.
    if (summary.iteration == 0) return ceres::SOLVER_CONTINUE;
    return run_.ends_after_step(summary.cost, {}) ? ceres::SOLVER_TERMINATE_SUCCESSFULLY
                                                  : ceres::SOLVER_CONTINUE;
  }

 private:
  MinimizeRun& run_;
};

ceres::GradientProblemSolver::Options ceres_options(const MinimizeOptions& options, long steps) {
  ceres::GradientProblemSolver::Options out;
  out.line_search_direction_type =
      options.method == Method::Lbfgs ? ceres::LBFGS : ceres::NONLINEAR_CONJUGATE_GRADIENT;
  out.nonlinear_conjugate_gradient_type = ceres::POLAK_RIBIERE;
  out.max_lbfgs_rank = options.memory;
  out.line_search_type = ceres::WOLFE;
  out.max_num_iterations = static_cast<int>(steps);
  out.gradient_tolerance = options.gradient_tolerance;
  out.function_tolerance = options.loss_tolerance;
  out.parameter_tolerance = 1e-16;
  out.logging_type = ceres::SILENT;
  return out;
}

}  // namespace

void run_ceres(MinimizeRun& run, std::vector<double> x) {
  // Suppress its log about failed line searches on standard error; our report contains it.
  FLAGS_minloglevel = google::GLOG_FATAL;
  const ceres::GradientProblem problem(new CeresLoss(run));
  CeresSteps steps(run);
  while (!run.ended()) {
    const double before = run.found().loss;
    auto options = ceres_options(run.options(), run.steps_left());
    options.callbacks.push_back(&steps);
    ceres::GradientProblemSolver::Summary summary;
    ceres::Solve(options, problem, x.data(), &summary);
    if (run.ended()) return;
    if (summary.termination_type == ceres::CONVERGENCE) return run.end("it converged");
    if (!(run.found().loss < before)) return run.end("the line search found no decrease");
    x = run.found().x;
  }
}

}  // namespace apps
