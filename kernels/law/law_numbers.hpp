#pragma once

/// The numbers that a scene gives of the law between two materials, as a list: keys of scene files, the
/// default rule, checks and the resolved scene go through it.

#include <span>

#include "kernels/law/pair_table.hpp"

namespace talus {

struct LawNumberEntry {
  LawNumber number;
  const char* name;      ///< key of [material] and [[pair]]
  const char* unit;      ///< "": none
  double most;           ///< it lies in [0, most]
  const char* sentence;  ///< for the reference of scene files
};

std::span<const LawNumberEntry> law_numbers();

}  // namespace talus
