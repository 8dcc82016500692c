#include "autodiff/sweeps/omitted_gradients.h"

#include "autodiff/time/overwrite_time.h"
#include "diagnostics/error.h"

namespace retrograde::autodiff {

namespace {

using Names = std::vector<const Symbol*>;

SynthesisResult synthesize(const Seed& seed, const SynthesisOptions& options) {
  return options.checkpoints.is_set() ? synthesize_folded(seed, options)
                                      : synthesize_adjoints(seed, options);
}

// Scalars that were not requested; they get gradients only because everything does.
Names unrequested_scalars(const Seed& seed, const SynthesisOptions& options) {
  Names scalars;
  if (options.only_requested) return scalars;
  for (const auto& p : parameters_of({seed.output})) {
    if (!p->is_buffer && p->type.is_float()) scalars.push_back(p.get());
  }
  return scalars;
}

std::optional<SynthesisResult> without(const Names& names, const Seed& seed,
                                       SynthesisOptions options, const std::string& why) {
  for (const Symbol* symbol : names) options.left_out[symbol] = why;
  try {
    return synthesize(seed, options);
  } catch (const InternalError&) {
    throw;
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace

SynthesisResult synthesize_supported(const Seed& seed, const SynthesisOptions& options) {
  try {
    return synthesize(seed, options);
  } catch (const InternalError&) {
    throw;
  } catch (const Error& error) {
    const Names scalars = unrequested_scalars(seed, options);
    for (const Symbol* symbol : scalars) {
      if (auto result = without({symbol}, seed, options, error.what())) return *std::move(result);
    }
    if (scalars.size() > 1) {
      if (auto result = without(scalars, seed, options, error.what())) return *std::move(result);
    }
    throw;
  }
}

}  // namespace retrograde::autodiff
