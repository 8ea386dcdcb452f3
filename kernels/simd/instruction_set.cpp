#include "kernels/simd/instruction_set.hpp"

#include <algorithm>
#include <array>

namespace talus {

namespace {

constexpr std::array<std::string_view, 4> names = {"auto", "portable", "avx2", "avx512"};

}  // namespace

std::string_view name_of(InstructionSet set) {
  return names[static_cast<std::size_t>(set)];
}

std::optional<InstructionSet> instruction_set_of(std::string_view name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return {};
  return static_cast<InstructionSet>(found - names.begin());
}

bool runs_here(InstructionSet set) {
#ifdef __x86_64__
  if (set == InstructionSet::avx512)
    return runs_here(InstructionSet::avx2) && __builtin_cpu_supports("avx512f") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  if (set == InstructionSet::avx2) return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#endif
  return set == InstructionSet::portable;
}

InstructionSet best_instruction_set() {
  for (const InstructionSet set : {InstructionSet::avx512, InstructionSet::avx2})
    if (runs_here(set)) return set;
  return InstructionSet::portable;
}

}  // namespace talus
