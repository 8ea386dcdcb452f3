#pragma once

#include <optional>
#include <string_view>

namespace talus {

/// From the weakest to the strongest. All give the same bits: they are one text, compiled three times
/// (docs/decisions/0008-lanes.md).
enum class InstructionSet {
  automatic,  ///< the strongest that runs here, and in a simulation on all ranks (`settled`)
  portable,   ///< what the compiler assumes of every processor; slow where that has no fused product
  avx2,       ///< 4 contacts at a time (AVX2, FMA)
  avx512,     ///< 8 contacts at a time (F, DQ, VL)
};

/// "auto", "portable", "avx2" or "avx512".
std::string_view name_of(InstructionSet set);
/// The set of that name; nothing for other names.
std::optional<InstructionSet> instruction_set_of(std::string_view name);

/// Whether the processor and the operating system run `set`; false for `automatic`.
bool runs_here(InstructionSet set);

/// The strongest set that runs here.
InstructionSet best_instruction_set();

}  // namespace talus
