#pragma once

/// Alone in a file, since kernels of one instruction set may include no header with functions.

#include <cstdint>

namespace talus {

/// Numbers in the record of a body (VelocityOf), as kernels count them that read records as plain numbers.
inline constexpr std::uint32_t record_numbers = 8;

}  // namespace talus
