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
  graph.cell = step.cell();
  graph.pairs.reserve(step.contacts());
  step.each_place([&](std::size_t c, std::size_t k) { graph.pairs.push_back(step.pair_at(c, k)); });
  return graph;
}

}  // namespace

ContactGraph graph_of(const BodyProblem& problem) {
  ContactGraph graph;
  for (const BodyUnknown& body : problem.bodies) graph.mass.push_back(body.mass);
  for (const ContactEquation& c : problem.contacts) graph.pairs.push_back({c.first, c.second});
  if (problem.has_cell()) graph.cell = static_cast<std::int32_t>(problem.bodies.size()) - 1;
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

BodyProblem gather_problem(const StepReader& step, std::span<const char> taken, OtherBodies others) {
  BodyProblem problem;
  note_copies(step, problem);
  problem.grains = step.grains();
  const auto is_taken = [&](std::size_t body) { return taken.empty() || taken[body] != 0; };
  problem.bodies.resize(step.unknowns());
  for (std::size_t b = 0; b < step.unknowns(); ++b)
    if (others == OtherBodies::as_they_are || b >= step.grains() || is_taken(b))
      problem.bodies[b] = step.unknown(b);
  std::size_t contacts = 0;
  const auto each_taken = [&](const auto& visit) {
    step.each_place([&](std::size_t c, std::size_t k) {
      if (is_taken(at(step.pair_at(c, k)[0]))) visit(c, k);
    });
  };
  each_taken([&](std::size_t, std::size_t) { ++contacts; });
  problem.contacts.reserve(contacts);
  problem.impulse.reserve(contacts);
  each_taken([&](std::size_t c, std::size_t k) {
    problem.contacts.push_back(step.equation_at(c, k));
    problem.impulse.push_back(step.impulse_of(problem.contacts.back()));
    if (step.rolls()) problem.rolling.push_back(step.rolling_at(k));
  });
  if (!step.knows_more() || step.contacts() == 0) return problem;
  problem.known.resize(problem.bodies.size());
  step.add_known(problem.known);
  return problem;
}

BodyProblem gather_problem(const StepReader& step) {
  return gather_problem(step, {}, OtherBodies::as_they_are);
}

BodyProblem gather_problem(const BodyProblemSource& source) {
  return gather_problem(StepReader(source));
}

BodyProblem gather_problem(const BodyProblemSource& source, const BodyProblemPart& part) {
  return gather_problem(StepReader(source, part));
}

void scatter_impulses(const BodyProblem& problem, Contacts& contacts) {
  for (std::size_t k = 0; k < problem.contacts.size(); ++k)
    set_law_impulse(contacts, at(problem.contacts[k].place), problem.impulse[k]);
  for (std::size_t k = 0; k < problem.rolling.size(); ++k) {
    const std::size_t place = at(problem.contacts[k].place);
    const Vec3& moment = problem.rolling[k].moment;
    contacts.mx[place] = moment[0];
    contacts.my[place] = moment[1];
    contacts.mz[place] = moment[2];
  }
}

std::vector<Twist> velocities_of(const BodyProblem& problem, std::span<const Vec3> impulse) {
  std::vector<Twist> V(problem.bodies.size());
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) add_force(problem.contacts[k], impulse[k], V);
  for (std::size_t b = 0; b < V.size(); ++b) velocity_from_force(problem.bodies[b], V[b]);
  return V;
}

}  // namespace talus
