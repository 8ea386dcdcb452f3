#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "io/scene/scene.hpp"
#include "kernels/samples/sample.hpp"

namespace talus::io {

/// Reads spheres from a CSV file whose first line is "id,x,y,z,radius", "id,x,y,z,radius,vx,vy,vz" or the
/// latter with ",wx,wy,wz": centres and radii [m], velocities [m/s], angular velocities [rad/s] (kept as w =
/// R omega); a last column ",material" may follow, with names of `materials`. Blank lines, lines that begin
/// with '#' and a byte order mark are skipped. `density` > 0 [kg/m^3]; with `rotates` false the spheres do
/// not rotate and wx, wy, wz are dropped. Throws SceneError with file, line and column for a missing file, an
/// unknown header, a wrong number of fields, a field that is not a finite number, a radius that is not
/// positive, and an id that occurs twice or is negative.
Sample read_bodies(const std::string& path, double density, bool rotates = true,
                   std::span<const MaterialSpec> materials = {});

/// The same grains as a file that read_bodies reads back bit for bit, but for spins, which are rounded: the
/// file has w = (R omega) / R. Throws FileError.
void write_bodies(const std::filesystem::path& path, const Sample& sample);

}  // namespace talus::io
