#pragma once

#include <optional>
#include <string>

#include "io/scene/scene.hpp"
#include "kernels/samples/sample.hpp"

namespace talus {

/// The grains of all samples of a scene, one sample behind the other, at rest unless it says otherwise; ids
/// 0, 1, ..., but those of a file or a state, behind which the others go on. `state`: what read_state gave,
/// where it is at hand. Throws io::SceneError when a file is missing or damaged, when a grain has no mass or
/// speed that is finite, or samples overlap one another, std::invalid_argument when grains do not fit their
/// base, std::runtime_error when a signal asks to stop (signals.hpp).
Sample build_sample(const io::Scene& scene, std::optional<Sample> state = std::nullopt);

/// Throws io::SceneError when this machine has no memory for one rank's part of the graph of a step of so
/// many subdomains.
void demand_memory_of_graph(const io::Scene& scene, int ranks);

/// Where materials have names: gives the grains that have none that of a sample of the scene, and all their
/// densities.
void put_materials(const io::Scene& scene, Sample& sample, std::size_t of_sample = 0);

/// How many grains overlap others or walls (placed, io::place_walls) by more than a tenth of the smaller
/// radius, the worst of them, and what to do; "" when none does.
std::string describe_overlaps(const io::Scene& scene, const Sample& sample);

}  // namespace talus
