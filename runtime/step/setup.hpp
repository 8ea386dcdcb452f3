#pragma once

/// What a simulation is made of, once files have been read: no paths, no formats, SI units.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/detection/domain.hpp"
#include "kernels/law/pair_table.hpp"
#include "kernels/law/restitution_law.hpp"
#include "kernels/registry.hpp"
#include "kernels/shapes/clump.hpp"
#include "kernels/shapes/walls.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"
#include "partition/partitioner.hpp"
#include "runtime/step/grain_rules.hpp"
#include "runtime/step/probe_rules.hpp"

namespace talus {

/// Number of steps of `time_step` in `time`, both in s: the nearest integer, where half a step rounds down.
/// Rounded, because a sum of many time steps is not exactly their product.
inline double steps_in(double time, double time_step) {
  return std::ceil(time / time_step - 0.5);
}

/// When a stage ends: at the first of the conditions given. At least one is given.
struct StageEnd {
  std::optional<std::int64_t> steps;
  std::optional<double> time;    ///< [s] of the stage
  std::optional<double> strain;  ///< |axial strain| (28) since the beginning of the stage, along strain_axis
  int strain_axis = 2;           ///< 0, 1, 2 = x, y, z
  std::optional<double>
      shear_strain;  ///< path of the periodic cell's shear: shear_rate (cell_flow.hpp) x time
  /// Bound on StepReport::equilibrium.
  std::optional<double> equilibrium;
  /// Time for which that bound must have held without a break, >= 0, in times that a grain takes to fall by
  /// its diameter under the load of the sample (fall_time in step_report.hpp): a sample that has just begun
  /// to move is slow, too.
  double equilibrium_hold = 3;
  /// q/p of the contacts in a step, q = root of 3/2 s : s, at which the stage ends.
  std::optional<double> stress_ratio;
  /// Bounds on the inertial number of a periodic cell (cell.csv), below and above, and for how many inertial
  /// times d root of density over p, >= 0, one of them must have held without a break.
  std::optional<double> inertial_below, inertial_above;
  double inertial_hold = 3;
  /// Bound on the drift of a steady state: the larger of the changes of the mean q/p and of the mean solid
  /// fraction from one window to the next.
  std::optional<double> steady;
  double steady_strain = 0.1;         ///< length of a window, as path of the cell's shear, > 0
  std::optional<double> steady_time;  ///< instead, as time [s]

  /// Ends that depend on what the grains do.
  bool by_state() const { return strain || shear_strain || equilibrium || by_memory(); }
  /// ... and on steps before the last one, or its stress.
  bool by_memory() const { return stress_ratio || inertial_below || inertial_above || steady; }
  bool any() const { return steps || time || by_state(); }
};

/// The stress that components of a periodic cell follow, as it pushes the grains together: xx, yy, zz, xy,
/// xz, yz [Pa]. In a stage that began t ago a component aims at
///   from + (to - from) min(1, t/ramp_time) + amplitude sin(2 pi t/period),
/// `from` what the stage before aimed at when it ended, perhaps within its own ramp, or 0 where it prescribed
/// the flow; of the first stage Setup::stress_at_start.
struct StressLoad {
  std::array<std::optional<double>, 6> to;  ///< [Pa]; without one a component is driven at its rate
  double ramp_time = 0;                     ///< [s]; 0: at once
  std::array<double, 6> amplitude{};        ///< [Pa]
  double period = 0;                        ///< [s]; > 0 where any amplitude is not 0

  bool any() const {
    return std::ranges::any_of(to, [](const auto& component) { return component.has_value(); });
  }
  /// A face of the cell is pushed or pulled: a normal component aims at something, or swings about 0.
  bool presses() const {
    for (std::size_t k = 0; k < 3; ++k)
      if (to[k] && (*to[k] != 0 || amplitude[k] != 0)) return true;
    return false;
  }
};

/// A wall whose load a stage changes.
struct StageLoad {
  std::string wall;  ///< its name
  WallLoad load;
};

/// One stage: a time interval with its own loads.
struct Stage {
  std::string name;
  double time_step = 0;              ///< h [s] > 0; 0 where each step's is chosen
  bool chooses_time_step = false;    ///< each step's h is chosen (time_step.hpp), between:
  double time_step_max = 0;          ///< [s]; 0: the time of a small fall, so there must be gravity
  double time_step_min = 0;          ///< [s]; 0: a part of the longest
  Vec3 gravity = Vec3::Zero();       ///< [m/s^2]
  Vec3 strain_rates = Vec3::Zero();  ///< of the periodic cell: dv_x/dx, dv_y/dy, dv_z/dz [1/s]
  Vec3 shear_rates = Vec3::Zero();   ///< dv_x/dy, dv_x/dz, dv_y/dz [1/s]
  StressLoad stress;                 ///< of the periodic cell
  /// Bounds on a step that the scene gives [s]: 0, and infinity, where it leaves that open.
  double shortest_step() const { return chooses_time_step ? time_step_min : time_step; }
  double longest_step() const {
    if (!chooses_time_step) return time_step;
    return time_step_max > 0 ? time_step_max : std::numeric_limits<double>::infinity();
  }
  /// The cell may change along an axis.
  bool strains(int axis) const {
    return strain_rates[axis] != 0 || stress.to[static_cast<std::size_t>(axis)].has_value();
  }
  bool flows() const { return !strain_rates.isZero(0) || !shear_rates.isZero(0) || stress.any(); }
  /// The cell may change its shape, not its size alone.
  bool shears() const {
    const bool alike = (strain_rates.array() == strain_rates[0]).all();
    return !alike || !shear_rates.isZero(0) || stress.any();
  }
  PairTable laws;                ///< of the setup's materials
  std::vector<StageLoad> loads;  ///< that change when the stage begins
  StageEnd end;
};

struct DetectionSettings {
  double alert = 0;  ///< [m] a pair with a smaller gap is a contact of the step; 0: 0.1 x smallest radius
  double skin = -1;  ///< [m] margin of the candidates beyond alert; < 0: 0.2 x smallest radius
};

/// The distances meant, where the smallest grain has this radius [m].
inline double alert_distance(const DetectionSettings& detection, double smallest) {
  return detection.alert > 0 ? detection.alert : 0.1 * smallest;
}
inline double skin_distance(const DetectionSettings& detection, double smallest) {
  return detection.skin >= 0 ? detection.skin : 0.2 * smallest;
}

/// A method of solving the contact problem by sweeps, known by its name in the registry:
/// runtime/step/methods/ has a file for each. The constants below are the methods that code refers to.
class SolverMethod : public NamedKind<SolverMethod> {
 public:
  using NamedKind::NamedKind;
  /// "auto": momentum (plain sweeps for Schwarz, whose damped iteration is no descent); ADMM once sweeps have
  /// left the forces out of balance in a problem that is too stiff for sweeps.
  static const SolverMethod automatic;
  static const SolverMethod nlgs;      ///< nonlinear Gauss-Seidel as it is (Jean 1999)
  static const SolverMethod momentum;  ///< "nlgs+momentum": each sweep begins beyond where the last one ended
                                       ///< (Nesterov 1983), with restarts
  static const SolverMethod nncg;      ///< nonsmooth nonlinear conjugate gradients (Silcowitz-Hansen, Niebe,
                                       ///< Erleben 2010)
  static const SolverMethod admm;  ///< one call of ADMM in body space (kernels/global/admm.hpp), then sweeps
                                   ///< as they are
};
inline constexpr SolverMethod SolverMethod::automatic("auto");
inline constexpr SolverMethod SolverMethod::nlgs("nlgs");
inline constexpr SolverMethod SolverMethod::momentum("nlgs+momentum");
inline constexpr SolverMethod SolverMethod::nncg("nncg");
inline constexpr SolverMethod SolverMethod::admm("admm");

/// Floating-point numbers of the sweeps. Everything that is checked and written is in double precision.
enum class Precision {
  mixed,  ///< single while the error is large and single precision can still reduce it
          ///< (docs/decisions/0015-single-precision.md)
  full,   ///< double
};

struct SolverSettings {
  SolverMethod method = SolverMethod::automatic;
  double tolerance = 1e-3;  ///< on error_rms: natural map, relative (docs/theory.md, "Error")
  /// On error_max, of the worst contact; 0: most_over_rms times `tolerance`. This factor and that of
  /// velocity_tolerance stand beside what they replace; no scene sets them.
  double max_tolerance = 0;
  static constexpr double most_over_rms = 100;
  double worst_allowed() const { return max_tolerance > 0 ? max_tolerance : most_over_rms * tolerance; }
  /// On error_quantile, that a share `quantile` of the contacts does not exceed; 0: not checked.
  double quantile_tolerance = 0;
  double quantile = 0.99;  ///< in (0, 1]
  double balance_tolerance =
      5e-2;  ///< on balance: estimated error of wall forces and momentum (kernels/global/balance.hpp)
  /// On velocity_error, of clusters that no direct solve takes; 0: balance_tolerance, with friction
  /// sliding_over_balance times that, at most 1, as what is wrong by all that is exchanged says nothing, or
  /// balance_tolerance, if that is more (docs/decisions/0030-work-of-errors.md).
  double velocity_tolerance = 0;
  static constexpr double sliding_over_balance = 10;
  double velocity_allowed(bool friction) const {
    if (velocity_tolerance > 0) return velocity_tolerance;
    return friction ? std::max(balance_tolerance, std::min(sliding_over_balance * balance_tolerance, 1.0))
                    : balance_tolerance;
  }
  /// Clusters of more bodies are judged by estimates alone, whatever SmallClusters allows, in [0, 5000].
  int direct_bodies = 5000;
  /// On overlap: depth of a pair at the end of a step, beyond what it was given, over the smaller radius.
  double overlap_tolerance = 0.05;
  int max_iterations = 2000;  ///< sweeps per step, >= 1
  int check_every =
      10;  ///< sweeps between the first checks; later ones stand where the tolerance is expected, >= 1
  bool warm_start = true;  ///< begin from the impulses of the last step
  RestitutionLaw restitution_law = RestitutionLaw::moreau;
  double overlap_correction =
      0;  ///< in [0, 1]: part of an overlap that a step undoes (kernels/sweeps/positions.hpp)
  Precision precision = Precision::mixed;
  InstructionSet simd = InstructionSet::automatic;  ///< of the sweeps
};

/// Messages in traces name them by 16 bits, of which one value is the root (runtime/trace/trace.hpp).
inline constexpr int most_subdomains = 65535;

/// How subdomains act on one another.
enum class Coupling {
  nscdd,  ///< copies carry M/m and are glued to the mean of their velocities (Visseq et al. 2013, (7)-(15))
  alternating,  ///< likewise, but one subdomain colour after another: a copy carries M over the number of
                ///< copies of its colour, and begins with the velocity that the colours before it have left
                ///< (docs/decisions/0007-couplings.md)
  schwarz,      ///< copies carry M and add up what each gained (the paper's (16)-(27))
};

/// decomposition.coupling in scenes.
const Registry<Coupling>& couplings();

/// Which way interface velocities travel.
enum class ExchangeScheme {
  dcs,  ///< between the subdomains that share a body
  ccs,  ///< to one rank and back
};

/// The quantity that is to be shared out equally among subdomains.
enum class BalanceBy {
  work,      ///< candidates, plus the cost of gluing the interface, in candidates
  contacts,  ///< candidates
  time,      ///< measured time of their sweeps: for cores of unequal speed. Partition and bits vary with it
};

/// Which rank has which subdomain. No result depends on it.
enum class SubdomainMapping {
  block,   ///< consecutive subdomains share a rank: fewest messages between ranks
  cyclic,  ///< subdomain e is on rank e modulo the ranks: where work varies slowly over the sample
};

struct DecompositionSettings {
  Coupling coupling = Coupling::alternating;
  ExchangeScheme exchange = ExchangeScheme::dcs;
  PartitionKind partitioner = PartitionKind::automatic;
  int subdomains = 0;                   ///< 0: one per rank; at most most_subdomains
  std::array<std::int64_t, 3> boxes{};  ///< per axis, for the partitioners that cut boxes; zeros: chosen
  SubdomainMapping mapping = SubdomainMapping::block;
  int sweeps_per_exchange = 1;  ///< n_GS >= 1
  BalanceBy balance = BalanceBy::work;
  int repartition_every = 10;  ///< least steps between partitions; made only when candidates are found anew
  double max_imbalance = 0.2;  ///< contacts of the fullest over those of the mean subdomain, less 1: beyond
                               ///< it candidates are found and space is cut anew at once
  bool overlap = true;         ///< inner chunks while messages travel; false: after them, to measure the gain
  bool damping = true;         ///< schwarz: false is the paper's form, which diverges where m > 2
};

/// A body whose path is reported step by step.
struct NamedBody {
  std::string name;
  BodyId id{-1};
};

/// A simulation, apart from its grains.
struct Setup {
  std::vector<NamedBody> named;
  std::vector<InsertRule> inserts;
  std::vector<RemoveRule> removes;
  std::vector<ProbeRule> probes;
  std::vector<FieldRule> fields;
  std::vector<std::string> material_names;  ///< by number; empty where the scene names none
  Domain domain;                            ///< that the grains stand in
  /// Mass of a cell that follows a stress, over that of all grains, > 0 (docs/theory.md, "Cells under
  /// stress").
  double cell_inertia = 1;
  /// What ramps of the first stage begin from, xx, yy, zz, xy, xz, yz [Pa]: the stress of a sample that was
  /// in a periodic cell before.
  std::array<double, 6> stress_at_start{};
  std::vector<Wall> walls;
  std::vector<WallGroup> groups = {};  ///< that walls name
  std::vector<Clump> clumps;           ///< shapes of bodies that are no spheres (Bodies::shape)
  std::vector<Stage> stages;
  DetectionSettings detection;
  SolverSettings solver;
  DecompositionSettings decomposition;
  bool rotation = true;            ///< false: grains slide and do not turn
  bool orientation = false;        ///< true: integrate and write orientations
  bool allow_unconverged = false;  ///< true: steps over tolerance do not change the exit code
  std::uint64_t seed = 1;
};

/// Whether a wall is there in the first stage.
inline bool stands_at_first(const Setup& setup, const Wall& wall) {
  return wall.from_stage.empty() || setup.stages.empty() || wall.from_stage == setup.stages.front().name;
}

/// Throws std::invalid_argument with the name of the wall or stage, the value and its limit when the setup
/// makes no sense.
void validate(const Setup& setup);

}  // namespace talus
