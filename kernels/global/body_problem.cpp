#include "kernels/global/body_problem.hpp"

#include "kernels/bodies/index.hpp"
#include "kernels/detection/measures.hpp"
#include "kernels/global/step_reader.hpp"

namespace talus {

namespace {

/// What a problem and its graph say of their unknowns: which count, and which have copies elsewhere.
template <class Unknowns>
void note_copies(const StepReader& step, Unknowns& to) {
  to.subdomain = step.subdomain();
  if (!step.in_parts()) return;
  for (std::size_t b = 0; b < step.unknowns(); ++b) {
    to.counts.push_back(step.counted(b) ? 1 : 0);
    if (step.shared(b)) to.shared.push_back(static_cast<std::int32_t>(b));
  }
}

ContactGraph graph_of(const StepReader& step) {
  ContactGraph graph;
  note_copies(step, graph);
  graph.mass.reserve(step.unknowns());
  for (std::size_t b = 0; b < step.unknowns(); ++b) graph.mass.push_back(step.mass(b));
  graph.pairs.reserve(step.contacts());
  step.each_place([&](std::size_t c, std::size_t k) { graph.pairs.push_back(step.pair_at(c, k)); });
  return graph;
}

BodyProblem problem_of(const StepReader& step) {
  BodyProblem problem;
  note_copies(step, problem);
  problem.grains = step.grains();
  problem.bodies.reserve(step.unknowns());
  for (std::size_t b = 0; b < step.unknowns(); ++b) problem.bodies.push_back(step.unknown(b));
  const std::size_t contacts = step.contacts();
  problem.contacts.reserve(contacts);
  problem.impulse.reserve(contacts);
  step.each_contact([&](const ContactEquation& contact, const Vec3& impulse) {
    problem.contacts.push_back(contact);
    problem.impulse.push_back(impulse);
  });
  if (!step.knows_more() || contacts == 0) return problem;
  problem.known.resize(problem.bodies.size());
  step.add_known(problem.known);
  return problem;
}

}  // namespace

ContactGraph graph_of(const BodyProblem& problem) {
  ContactGraph graph;
  for (const BodyUnknown& body : problem.bodies) graph.mass.push_back(body.mass);
  for (const ContactEquation& c : problem.contacts) graph.pairs.push_back({c.first, c.second});
  graph.subdomain = problem.subdomain;
  graph.counts = problem.counts;
  graph.shared = problem.shared;
  return graph;
}

ContactGraph gather_graph(const BodyProblemSource& source) {
  return graph_of(StepReader(source));
}

ContactGraph gather_graph(const BodyProblemSource& source, const BodyProblemPart& part) {
  return graph_of(StepReader(source, part));
}

BodyProblem gather_problem(const BodyProblemSource& source) {
  return problem_of(StepReader(source));
}

BodyProblem gather_problem(const BodyProblemSource& source, const BodyProblemPart& part) {
  return problem_of(StepReader(source, part));
}

void keep_contacts(BodyProblem& problem, std::span<const char> taken) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    if (taken[at(problem.contacts[k].first)] == 0) continue;
    problem.contacts[kept] = problem.contacts[k];
    problem.impulse[kept++] = problem.impulse[k];
  }
  problem.contacts.resize(kept);
  problem.impulse.resize(kept);
}

void scatter_impulses(const BodyProblem& problem, Contacts& contacts) {
  for (std::size_t k = 0; k < problem.contacts.size(); ++k)
    set_law_impulse(contacts, at(problem.contacts[k].place), problem.impulse[k]);
}

std::vector<Twist> velocities_of(const BodyProblem& problem, std::span<const Vec3> impulse) {
  std::vector<Twist> V(problem.bodies.size());
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) add_force(problem.contacts[k], impulse[k], V);
  for (std::size_t b = 0; b < V.size(); ++b) velocity_from_force(problem.bodies[b], V[b]);
  return V;
}

}  // namespace talus
