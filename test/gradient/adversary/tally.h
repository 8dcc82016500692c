// What a run of the fuzzer did, counted.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "gradient/adversary/check.h"

namespace retrograde::gradient {

// The rule that a refusal names, without names and numbers: what refusals are counted by.
std::string reason_of(const std::string& message);

class Tally {
 public:
  void add(const Judged& judged);
  void add_finding() { ++tried_, ++found_; }
  uint64_t tried() const { return tried_; }
  uint64_t found() const { return found_; }
  // More than a third: then little is tested.
  bool refuses_much() const;
  // One line of counts, then one for each reason of refusals, the most frequent first.
  std::string summary(double seconds) const;

 private:
  uint64_t count(Judgement judgement) const;
  uint64_t tried_ = 0, found_ = 0;
  std::map<Judgement, uint64_t> judgements_;
  std::map<unsigned, uint64_t> checked_;
  std::map<std::string, uint64_t> reasons_;
};

}  // namespace retrograde::gradient
