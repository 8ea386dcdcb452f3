#pragma once

/// Groups of a cluster whose bodies push one another. A contact that carries nothing joins two parts of a
/// cluster, though what happens in the one says nothing of the other: a ball that others hit at 5 m/s hides,
/// by what they exchange, that a column falls which it merely touches.

#include <cstddef>
#include <span>
#include <vector>

#include "kernels/global/body_problem.hpp"

namespace talus {

/// A part of a cluster as a problem of its own, which is answered as a cluster is: bodies that push one
/// another, or one that nothing pushes.
struct LoadedGroup {
  BodyProblem problem;                ///< levers are the cluster's
  std::vector<std::size_t> bodies;    ///< per unknown: its number in the cluster, ascending
  std::vector<std::size_t> contacts;  ///< per contact, likewise
};

/// The contacts that carry something, however little: 1, else 0; grains that cohesion holds do. In a cell
/// that follows a stress all do, as each moves it.
std::vector<char> carrying(const BodyProblem& cluster);

/// Bodies that the contacts of which `joins` is 1 connect, in order of their lowest ones, with all contacts
/// among them. Bodies without such contacts are groups of one. `joins`: per contact.
std::vector<LoadedGroup> loaded_groups(const BodyProblem& cluster, std::span<const char> joins);

/// Momentum [N s] with which a contact without impulse closes at velocities `V` of the cluster's unknowns: 0
/// where it opens.
double closing(const BodyProblem& cluster, const ContactEquation& contact, std::span<const Twist> V);

}  // namespace talus
