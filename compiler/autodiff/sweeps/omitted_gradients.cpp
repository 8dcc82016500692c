#include "autodiff/sweeps/omitted_gradients.h"

#include "autodiff/sweeps/factored_program.h"
#include "autodiff/time/overwrite_time.h"
#include "diagnostics/error.h"

namespace retrograde::autodiff {

namespace {

using Names = std::vector<const Symbol*>;

SynthesisResult synthesize(const Seeds& seeds, const SynthesisOptions& options) {
  return synthesize_factored(seeds, options, [](const Seeds& s, const SynthesisOptions& o) {
    return o.checkpoints.is_set() ? synthesize_folded(s, o) : synthesize_adjoints(s, o);
  });
}

// Scalars that were not requested; they get gradients only because everything does.
Names unrequested_scalars(const Seeds& seeds, const SynthesisOptions& options) {
  Names scalars;
  if (options.only_requested) return scalars;
  for (const auto& p : parameters_of(outputs_of(seeds))) {
    if (!p->is_buffer && p->type.is_float()) scalars.push_back(p.get());
  }
  return scalars;
}

std::optional<SynthesisResult> without(const Names& names, const Seeds& seeds,
                                       SynthesisOptions options, const std::string& why) {
  for (const Symbol* symbol : names) options.left_out[symbol] = why;
  try {
    return synthesize(seeds, options);
  } catch (const InternalError&) {
    throw;
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace

SynthesisResult synthesize_supported(const Seeds& seeds, const SynthesisOptions& options) {
  try {
    return synthesize(seeds, options);
  } catch (const InternalError&) {
    throw;
  } catch (const Error& error) {
    const Names scalars = unrequested_scalars(seeds, options);
    for (const Symbol* symbol : scalars) {
      if (auto result = without({symbol}, seeds, options, error.what())) return *std::move(result);
    }
    if (scalars.size() > 1) {
      if (auto result = without(scalars, seeds, options, error.what())) return *std::move(result);
    }
    throw;
  }
}

}  // namespace retrograde::autodiff
