#include "runtime/step/global_solver.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "kernels/clusters/cluster_work.hpp"
#include "kernels/clusters/clusters.hpp"
#include "kernels/clusters/step_error.hpp"
#include "kernels/global/balance.hpp"
#include "kernels/global/residuals.hpp"
#include "kernels/global/stiffness.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/step/step_link.hpp"
#include "runtime/step/task_kinds.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus {

namespace {

/// Kinetic energy of the velocities that impulses make, twice [J].
double energy_of(const BodyParts& parts) {
  const PartField velocity = velocities_of(parts);
  return parts.total(1, [&](std::size_t p, std::span<double> row) {
    const BodyProblem& problem = parts[p];
    for (std::size_t b = 0; b < problem.bodies.size(); ++b)
      if (problem.counted(b)) row[0] += kinetic2(problem.bodies[b], velocity[p][b].u, velocity[p][b].w);
  })[0];
}

/// The same as it is without contacts, and what driven walls and overlaps that part give if all bodies
/// follow; speeds of overlaps do not add up here, as they do along a chain. Gaps that close give nothing [J].
double energy_without(const BodyParts& parts) {
  enum : std::size_t { energy, mass, fastest };
  constexpr RowColumns columns{.sums = fastest, .largest = 1};
  const std::vector<double> all = parts.reduced(columns, 1, [&](std::size_t p, std::span<double> row) {
    const BodyProblem& problem = parts[p];
    for (std::size_t b = 0; b < problem.bodies.size(); ++b) {
      if (!problem.counted(b)) continue;
      row[energy] += kinetic2(problem.bodies[b], problem.bodies[b].free.u, problem.bodies[b].free.w);
      row[mass] += problem.bodies[b].mass;
    }
    for (const ContactEquation& c : problem.contacts)
      row[fastest] = std::max({row[fastest], std::abs(c.drive), -c.offset.dot(c.normal)});
  });
  return all[energy] + all[mass] * all[fastest] * all[fastest];
}

std::vector<WallMotion> motions_of(const StepState& state) {
  std::vector<WallMotion> walls;
  for (std::size_t w = 0; w < state.walls.size(); ++w)
    walls.push_back({state.walls[w].normal, state.wall_states[w].free_velocity, state.walls[w].inv_mass()});
  return walls;
}

CellMotion motion_of(const StressedCell& cell, const Domain& domain, const Mat3& prescribed) {
  if (!cell.loaded()) return {};
  const auto moves = [&](std::size_t k) { return cell.follows[k] ? 1.0 : 0.0; };
  return {cell.mass,
          {moves(0), moves(1), moves(2)},
          {moves(3), moves(4), moves(5)},
          domain.mean_edge() / cell.length,
          prescribed.cwiseAbs().maxCoeff()};
}

BodyProblemSource source_of(const StepState& state, const StepParameters& parameters,
                            const std::vector<WallMotion>& walls) {
  return {state.bodies.x,
          state.bodies.radius,
          state.bodies.velocity,
          state.free,
          walls,
          state.chunks,
          state.contacts,
          parameters.laws,
          state.decomposition.parts,
          motion_of(state.cell, state.domain, parameters.velocity_gradient)};
}

/// Contacts do something besides r: BodyProblem::known.
bool knows_more(const StepParameters& parameters) {
  return parameters.rolls || parameters.laws.attract();
}

}  // namespace

BodyProblem contact_problem(const StepState& state, const StepParameters& parameters) {
  const std::vector<WallMotion> walls = motions_of(state);
  BodyProblem problem = gather_problem(source_of(state, parameters, walls));
  if (knows_more(parameters)) set_free({&problem, 1}, PartLink{});
  return problem;
}

GlobalSolver::GlobalSolver(StepState& state, const StepParameters& parameters,
                           const DecompositionSettings& decomposition, Gluing& gluing,
                           const graph::Communicator& ranks)
    : state_(state),
      parameters_(parameters),
      decomposition_(decomposition),
      ranks_(ranks),
      link_(std::make_unique<StepLink>(state, gluing, ranks, crew_, rounds_, shared_)) {}

class GlobalSolver::Whole {
 public:
  explicit Whole(const GlobalSolver& solver)
      : solver_(solver), span_(solver.ranks_.trace(), kind_of(TaskKind::whole), 0, trace::Span::in_check) {
    solver.rounds_ = {};
    solver.shared_ = {};
  }
  ~Whole() {
    solver_.shared_.tell(graph::seconds_now() - began_, solver_.rounds_);
    span_.set_node(solver_.rounds_.packed());
  }
  Whole(const Whole&) = delete;
  Whole& operator=(const Whole&) = delete;

 private:
  const GlobalSolver& solver_;
  double began_ = graph::seconds_now();
  trace::Span span_;
};

/// gather(source), or gather(source, part) of each subdomain.
template <class Gather>
auto GlobalSolver::gather_parts(const BodyProblemSource& source, const Gather& gather) const {
  const Decomposition& all = state_.decomposition;
  std::vector<decltype(gather(source))> parts;
  if (!all.several()) {
    parts.push_back(gather(source));
    return parts;
  }
  for (const SubdomainPlace e : all.here.indices()) {
    const auto [begin, end] = all.slots_of(e);
    parts.push_back(gather(
        source, BodyProblemPart{all.here[e].value(), e.value(), begin, end, all.counts, all.multiplicity}));
  }
  return parts;
}

std::vector<BodyProblem> GlobalSolver::gather() const {
  const std::vector<WallMotion> walls = motions_of(state_);
  auto parts = gather_parts(source_of(state_, parameters_, walls),
                            [](const auto&... of) { return gather_problem(of...); });
  if (knows_more(parameters_)) set_free(parts, *link_);
  return parts;
}

std::vector<ContactGraph> GlobalSolver::gather_graphs() const {
  const std::vector<WallMotion> walls = motions_of(state_);
  return gather_parts(source_of(state_, parameters_, walls),
                      [](const auto&... of) { return gather_graph(of...); });
}

double GlobalSolver::sweeps_needed(double spread) const {
  if (state_.cell.loaded() || (state_.domain.repeats && state_.walls.empty()))
    return stiffness_of_cell(0.5 * state_.domain.edges().maxCoeff() / state_.cell.length, spread);
  const Whole span(*this);
  return estimate_stiffness(gather_graphs(), *link_);
}

void GlobalSolver::find_clusters(const SmallClusters& small, bool twice) {
  small_ = false;
  large_ = true;
  groups_ = {};
  const Whole span(*this);
  // A cell that follows a stress ties all contacts together.
  if (state_.cell.loaded() && state_.cell.grains >= (parameters_.friction ? small.bodies : small.smooth))
    return;
  const std::vector<ContactGraph> graphs = gather_graphs();
  const Clusters clusters = clusters_of(graphs, *link_);
  in_small_ = in_small_clusters(clusters, small, parameters_.friction);
  const std::vector<double> rows =
      rows_of(*link_, graphs.size(), 1, [&](std::size_t p, std::span<double> row) {
        for (const auto& [first, second] : graphs[p].pairs)
          if (in_small_[p][static_cast<std::size_t>(first)] != 0) row[0] = 1;
      });
  small_ = std::ranges::any_of(rows, [](double found) { return found > 0; });
  groups_ = large_clusters_of(clusters, in_small_, graphs, *link_);
  large_ = groups_.count > 0 || twice;
  twice_ = twice;
  if (groups_.count <= 1 && !twice && !small_)
    groups_ = {.of_body = {}, .count = groups_.count};  // nobody asks which
  if (!twice || !small_) return;
  // Small ones, which have their own answers, are one group more.
  for (std::size_t p = 0; p < groups_.of_body.size(); ++p)
    for (std::size_t b = 0; b < groups_.of_body[p].size(); ++b)
      if (in_small_[p][b] != 0) groups_.of_body[p][b] = groups_.count;
  ++groups_.count;
}

std::vector<std::unique_ptr<const StepReader>> GlobalSolver::read_checked(
    const BodyProblemSource& source) const {
  auto steps = gather_parts(source, [](const auto&... of) { return std::make_unique<StepReader>(of...); });
  if (ranks_.ranks() > 1)  // a sweep has gone on meanwhile
    for (const auto& step : steps) step->set_kept(state_.candidates.impulse);
  if (knows_more(parameters_)) {
    PartField free;
    for (const auto& step : steps) step->add_known(free.emplace_back(step->unknowns()));
    link_->sum_copies(free);
    for (std::size_t p = 0; p < steps.size(); ++p) {
      for (std::size_t b = 0; b < free[p].size(); ++b) velocity_from_force(steps[p]->unknown(b), free[p][b]);
      steps[p]->set_free(std::move(free[p]));
    }
  }
  return {std::make_move_iterator(steps.begin()), std::make_move_iterator(steps.end())};
}

ProblemReaders GlobalSolver::read_all_checked(const BodyProblemSource& source) const {
  auto steps = read_checked(source);
  return {std::make_move_iterator(steps.begin()), std::make_move_iterator(steps.end())};
}

std::vector<BodyProblem> GlobalSolver::checked(bool small) const {
  const std::vector<WallMotion> walls = motions_of(state_);
  const auto steps = read_checked(source_of(state_, parameters_, walls));
  std::vector<BodyProblem> problems;
  for (std::size_t p = 0; p < steps.size(); ++p) {
    std::vector<char> taken;
    if (small_ && large_ && (small || !twice_)) taken = in_small_[p];
    if (!small)
      for (char& t : taken) t = t == 0 ? 1 : 0;
    problems.push_back(
        gather_problem(*steps[p], taken, small ? OtherBodies::empty : OtherBodies::as_they_are));
  }
  return problems;
}

SmallError GlobalSolver::small_error(double enough, int sweeps, double farthest) {
  const Whole span(*this);
  const double began = graph::seconds_now();
  problems_ = checked(true);
  const double still = std::numeric_limits<double>::epsilon() * farthest / parameters_.time_step;
  double walls = 0;
  for (const WallState& wall : state_.wall_states) walls = std::max(walls, wall.impulse.norm());
  Vec3 faces = Vec3::Zero();
  for (const Eigen::Index axis : {0, 1, 2})
    if (const double edge = state_.domain.edges()[axis]; state_.domain.repeats && edge > 0)
      faces[axis] = (state_.cell.loaded() ? state_.cell.length : 1) / edge;
  StepError error =
      step_error(problems_, *link_,
                 {.enough = enough, .sweeps = sweeps, .still = still, .walls = walls, .faces = faces});
  change_ = std::move(error.change);
  moments_ = std::move(error.moments);
  mends_ = error.mends;
  // For `correct` the contacts and their impulses are enough.
  if (!mends_) problems_ = {};
  for (BodyProblem& problem : problems_) problem.bodies = {};
  // What is asked of the large clusters is asked of small ones, too, where these are looked at twice. Where
  // more than r is known of contacts, the free velocities of clusters hold it, and those of all bodies do
  // not.
  const bool apart = !twice_ && !knows_more(parameters_);
  small_seconds_ += graph::seconds_now() - began;
  return {.relative = error.relative(),
          .worst = error.worst,
          .mends = error.mends,
          .exchanged = apart ? error.exchanged : Exchanged{}};
}

double GlobalSolver::take_small_seconds() {
  return std::exchange(small_seconds_, 0);
}

double GlobalSolver::large_error(double enough) const {
  const Whole span(*this);
  std::vector<BodyProblem> problems = checked(false);
  const BodyGroups together;
  return velocity_error(problems, *link_, enough, several_large_clusters() ? groups_ : together).relative;
}

double GlobalSolver::large_work(double speed, double interest) const {
  const Whole span(*this);
  const std::vector<WallMotion> walls = motions_of(state_);
  std::vector<double> wall_inv_masses;
  for (const WallMotion& wall : walls) wall_inv_masses.push_back(wall.inv_mass);
  const ProblemReaders problems = read_all_checked(source_of(state_, parameters_, walls));
  return largest_work(problems, groups_, *link_, {speed, interest, wall_inv_masses});
}

double GlobalSolver::quantile_error(double part) const {
  const Whole span(*this);
  const std::vector<WallMotion> walls = motions_of(state_);
  const ProblemReaders problems = read_all_checked(source_of(state_, parameters_, walls));
  return quantile_of(residuals_of(problems, *link_), *link_, part);
}

WorstErrors GlobalSolver::worst_errors() const {
  const Whole span(*this);
  const std::vector<WallMotion> motions = motions_of(state_);
  const ProblemReaders parts = read_all_checked(source_of(state_, parameters_, motions));
  const Decomposition& all = state_.decomposition;
  UnknownNames names;
  const std::span<const BodyId> ids = state_.bodies.id;
  if (!all.several()) names.bodies.push_back(ids);
  if (all.several())
    for (const SubdomainPlace e : all.here.indices()) {
      const auto [begin, end] = all.slots_of(e);
      names.bodies.push_back(ids.subspan(begin, end - begin));
    }
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    if (state_.walls[w].inv_mass() > 0) names.walls.push_back(static_cast<std::int32_t>(w));
  const WorstErrors here = worst_errors_of(parts, residuals_of(parts, *link_), names);
  WorstErrors worst;
  for (const WorstErrors& of_rank : ranks_.gather_records(std::span<const WorstErrors>(&here, 1)))
    worst.take(of_rank);
  return worst;
}

void GlobalSolver::correct() {
  for (std::size_t p = 0; p < problems_.size(); ++p) {
    for (std::size_t k = 0; k < change_[p].size(); ++k) problems_[p].impulse[k] += change_[p][k];
    for (std::size_t k = 0; k < problems_[p].rolling.size(); ++k)
      problems_[p].rolling[k].moment += moments_[p][k];
    scatter_impulses(problems_[p], state_.contacts);
  }
}

void GlobalSolver::release_room() {
  problems_ = {};
  change_ = moments_ = {};
  mends_ = false;
}

BodyAdmmResult GlobalSolver::improve(double tolerance, int calls, const ImprovementThresholds& thresholds) {
  const Whole span(*this);
  std::vector<BodyProblem> problems = gather();
  const BodyParts parts(problems, *link_);
  BodyAdmmSettings settings;
  const int digits = thresholds.digits * calls;
  settings.tolerance = std::ldexp(settings.tolerance, -digits);
  settings.balance_tolerance =
      std::ldexp(std::min(settings.balance_tolerance, thresholds.finer * tolerance), -digits);
  const double without = energy_without(parts);
  BodyAdmmResult result = solve_admm(problems, *link_, settings);
  // Comparisons are false for NaN.
  const bool better = result.converged || calls == 0;  // unfinished is better than sweeps, not than ADMM
  if (better && result.momentum_defect <= thresholds.most_defect &&
      energy_of(parts) <= thresholds.most_energy * without)
    for (const BodyProblem& problem : problems) scatter_impulses(problem, state_.contacts);
  return result;
}

}  // namespace talus
