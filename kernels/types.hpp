#pragma once

/// Words shared by every kernel. SI units everywhere: m, s, kg, N, N s, m/s, rad.

#include <Eigen/Core>
#include <cstdint>
#include <span>

namespace talus {

using Vec3 = Eigen::Vector3d;

/// Identity of a grain for the whole run, on every rank; survives sorting, migration and restart.
enum class BodyId : std::int64_t {};

/// Place of a body in the arrays of this process; changes when bodies are sorted. Not a BodyId: mixing fails
/// to compile.
using Slot = std::int32_t;

/// Where the multiplicities m_i of bodies matter: one entry per slot, or empty when all are 1. Copies of a
/// body carry M/m_i (Visseq et al. 2013, (7)), but its error is that of the whole body.
using Multiplicities = std::span<const std::uint16_t>;

}  // namespace talus
