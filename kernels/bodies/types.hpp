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

/// Where it matters that bodies have copies: one entry per slot, or empty when all are 1. Either the
/// multiplicities m_i, or the parts into which a mass is divided for the copies: they carry M/m_i (Visseq et
/// al. 2013, (7)), or M over those of them that act at a time; the error is that of the whole body.
using Multiplicities = std::span<const std::uint16_t>;

}  // namespace talus
