#pragma once

/// Words shared by every kernel. SI units everywhere: m, s, kg, N, N s, m/s, rad.

#include <Eigen/Core>
#include <cstdint>

namespace talus {

using Vec3 = Eigen::Vector3d;

/// Identity of a grain for the whole run, on every rank; survives sorting, migration and restart.
enum class BodyId : std::int64_t {};

/// Place of a body in the arrays of this process; changes when bodies are sorted. Not a BodyId: mixing fails
/// to compile.
using Slot = std::int32_t;

}  // namespace talus
