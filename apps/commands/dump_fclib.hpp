#pragma once

#include <filesystem>
#include <functional>

#include "kernels/clusters/contact_matrix.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

/// Throws std::invalid_argument when the contact problems of this run cannot be dumped: on several ranks, or
/// with several subdomains, where a body's mass is shared by its copies.
void check_dump(const Setup& setup, int ranks);

/// The contact problem of the step just done, with the impulses that the step found: W = H' M^-1 H, q with
/// the gap and restitution terms in it, mu. One rank, one subdomain, spheres (check_dump).
ContactMatrix matrix_of_step(const Simulation& simulation);

/// Assembles that problem. What it returns writes it, with the impulses as its solution, to fclib_000012.hdf5
/// in `directory` for step 12, and belongs on the thread that writes files. Throws io::FileError there.
std::function<void()> fclib_dump(const Simulation& simulation, const std::filesystem::path& directory);

}  // namespace talus
