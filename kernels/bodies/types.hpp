#pragma once

/// Words shared by every kernel. SI units everywhere: m, s, kg, N, N s, m/s, rad.

#include <Eigen/Core>
#include <cstdint>
#include <span>

namespace talus {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// Identity of a grain for the whole run, on every rank; survives sorting, migration and restart.
enum class BodyId : std::int64_t {};

/// Place of a body in the arrays of this process; changes when bodies are sorted. Not a BodyId: mixing fails
/// to compile.
using Slot = std::int32_t;

/// One number per slot for bodies with copies; empty when all are 1. It is either the multiplicity m_i, or
/// the number of parts into which the mass is divided: a copy carries M/m_i (Visseq et al. 2013, (7)), or,
/// with alternating coupling, M over the number of copies that act at the same time. Errors are those of the
/// whole body.
using Multiplicities = std::span<const std::uint16_t>;

/// Number of a material in its scene.
using Material = std::uint8_t;
inline constexpr std::size_t most_materials = 255;

/// The materials of a scene that names none: its grains, and its walls.
inline constexpr Material material_of_grains = 0, material_of_walls = 1;

/// Shape of a body: 0 is the sphere, k the k-th clump of the setup (kernels/shapes/clump.hpp).
using ShapeNumber = std::uint8_t;
inline constexpr std::size_t most_clumps = 255;

}  // namespace talus
