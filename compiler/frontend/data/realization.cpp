#include "frontend/data/realization.h"

namespace retrograde {

Realization::Realization(std::vector<Buffer<>> buffers) : buffers_(std::move(buffers)) {
  if (buffers_.empty())
    user_error("make a Realization", "it holds at least one Buffer", "it was given none",
               "Give the output's Buffer");
  for (const Buffer<>& buffer : buffers_) {
    if (!buffer.defined())
      user_error("make a Realization", "its Buffers must be defined", "one of them is not",
                 "Construct each with its sizes");
  }
}

size_t Realization::checked(size_t i) const {
  if (i < buffers_.size()) return i;
  user_error(text("take Buffer ", i, " of a Realization"), "its Buffers are numbered from 0",
             text("it holds ", buffers_.size()), "Give a smaller number");
}

void Realization::check_one_value() const {
  if (buffers_.size() == 1) return;
  user_error("use a Realization as one Buffer", "it must hold exactly one",
             text("it holds ", buffers_.size()), "Take one of them: realization[0]");
}

}  // namespace retrograde
