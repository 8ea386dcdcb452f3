#include "apps/commands/plan.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>

#include "apps/commands/plan_measure.hpp"
#include "apps/commands/threads.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/placed_sample.hpp"
#include "apps/shared/print.hpp"
#include "io/scene/scene.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

namespace {

void line(const char* what, bool in, const std::string& why) {
  print_out("  {:<24}{:<5}{}\n", what, in ? "in" : "out", why);
}

/// What contacts do that most scenes do not ask for.
void print_laws(const Simulation& simulation) {
  const StepState& state = simulation.state();
  const auto mixed = std::ranges::count(state.chunks.law, mixed_laws);
  line("friction per contact", mixed > 0 && !state.contacts.mu.empty(),
       mixed > 0 ? fmt::format("{} of {} chunks mix pairs of materials", mixed, state.chunks.size())
                 : "every chunk is of one pair of materials");
  const PairTable& laws = simulation.parameters().laws;
  for (const Attraction* attraction : attractions)
    line(attraction->name, laws.largest(*attraction) > 0,
         fmt::format("{:g} {} at most", laws.largest(*attraction), attraction->unit));
  const double resistance = laws.largest(&PairLaw::rolling_resistance);
  line("rolling resistance", simulation.parameters().rolls,
       resistance > 0 ? fmt::format("mu_r = {:g} at most: moments, and sweeps as they are", resistance)
                      : "no moments at contacts");
  const auto blocks = std::ranges::count(state.chunks.kind, ChunkKind::blocks);
  line("3x3 contact problems", blocks > 0,
       blocks > 0 ? fmt::format("{} of {} chunks have clumps: levers, and sweeps as they are", blocks,
                                state.chunks.size())
                  : "spheres: the problem of a contact is diagonal");
}

void print_needs(const Simulation& simulation, const io::Scene& scene, int threads) {
  const StepParameters& parameters = simulation.parameters();
  const StepState& state = simulation.state();
  const auto driven = std::count_if(state.walls.begin(), state.walls.end(),
                                    [](const Wall& w) { return w.load.drive == WallDrive::velocity; });
  const auto pressed =
      std::count_if(state.walls.begin(), state.walls.end(), [](const Wall& w) { return w.load.pushed(); });
  line("tangential impulses", parameters.friction,
       parameters.friction ? "friction coefficients above 0"
                           : "no friction: one impulse component per contact, no tangential work");
  const bool turning = parameters.friction && scene.setup.rotation;
  line("rotation in the sweeps", turning,
       turning               ? "tangential impulses turn the grains"
       : parameters.friction ? "rotation = false"
                             : "nothing turns grains without friction");
  line("free angular velocities", turning || !state.free.w.empty(),
       turning || !state.free.w.empty() ? "24 bytes per grain" : "no grain turns");
  const bool oriented = !state.bodies.orientation.empty() || scene.setup.orientation;
  line("orientations", oriented,
       !oriented           ? "spheres need none; not asked for"
       : parameters.clumps ? "clumps have them: 32 bytes per grain"
                           : "asked for: 32 bytes per grain");
  const bool single = !state.single.velocity.empty();
  line("sweeps in double", !single,
       single ? "single precision until the error is small: half the bytes and divisions"
              : "no momentum, few candidates, or precision = \"double\"");
  line("gravity", parameters.gravity.norm() > 0,
       parameters.gravity.norm() > 0 ? fmt::format("{:g} m/s^2", parameters.gravity.norm()) : "none");
  const double restitution = parameters.laws.largest(&PairLaw::restitution);
  line("restitution", restitution > 0,
       restitution > 0
           ? fmt::format("e = {:g}, {} law", restitution, parameters.reflection > 0 ? "Moreau's" : "Newton's")
           : "e = 0");
  const double undone = scene.setup.solver.overlap_correction;
  line("overlaps undone", undone > 0,
       undone > 0 ? fmt::format("{:g} of an overlap per step, by ten sweeps behind the others", undone)
                  : "overlap_correction = 0: no sweeps of positions");
  print_laws(simulation);
  const auto moved =
      std::ranges::count_if(state.walls, [](const Wall& wall) { return !wall.motion.empty(); });
  line("moving walls", driven + pressed + moved > 0,
       fmt::format("{} driven, {} pushed, {} with a motion of {}", driven, pressed, moved,
                   state.walls.size()));
  line("gluing of wall copies", pressed > 0,
       pressed > 0 ? "two tasks per subdomain and one for all" : "no wall of finite mass");
  line("chunk dependencies", threads > 1,
       threads > 1 ? "between chunks of different threads only" : "one thread: chunks are swept in order");
  const Decomposition& all = state.decomposition;
  line("subdomains", all.several(),
       all.several() ? fmt::format("{} by {}: {} messages of {} bytes in all per iteration",
                                   all.partition.subdomains, name_of(all.partition.kind),
                                   simulation.messages().messages, simulation.messages().bytes)
                     : "one: no interface, no gluing of grains, no messages");
  line("MPI", false, "one rank: no MPI call");
  line("trace", false, "not asked for: no field allocated");
}

void print_costs(const Simulation& simulation) {
  const StepState& state = simulation.state();
  const auto grains = static_cast<double>(std::max<std::int64_t>(simulation.bodies(), 1));
  const auto candidates = static_cast<double>(std::max<std::size_t>(state.candidates.size(), 1));
  const auto contacts = static_cast<double>(std::max<std::int64_t>(simulation.report().contacts, 1));
  const double of_bodies = static_cast<double>(
      memory_used(state.bodies) + state.free.u.capacity() * 24 + state.free.w.capacity() * 24 +
      (state.single.velocity.capacity() + state.single.last_v.capacity()) * sizeof(SingleVelocity) +
      state.x_then.capacity() * sizeof(Vec3) + state.reach_then.capacity() * 8);
  const double of_contacts = static_cast<double>(memory_used(state)) - of_bodies;
  const auto copies = static_cast<std::int64_t>(state.bodies.size()) - simulation.bodies();
  if (simulation.bodies() == 0)
    print_out(
        "\n  no grains yet: what they will need in memory, tasks and precision is not known; begin from a "
        "state to see it\n");
  print_out("\n  {} grains{}, {} candidates, {} contacts in {} chunks of {} colours\n", simulation.bodies(),
            copies > 0 ? fmt::format(" and {} copies of them in other subdomains", copies) : "",
            state.candidates.size(), simulation.report().contacts, state.chunks.size(), state.chunks.colours);
  print_out("  {:.0f} bytes per grain, {:.0f} bytes per candidate ({:.0f} per contact), {:.3g} MB in all\n",
            of_bodies / grains, of_contacts / candidates, of_contacts / contacts,
            static_cast<double>(memory_used(state)) / 1e6);
  print_out("  {} tasks per sweep ({:.4f} per contact), {} tasks per step outside the sweeps\n",
            state.chunks.size(), static_cast<double>(state.chunks.size()) / contacts,
            simulation.step_graph().size() - 1);
}

}  // namespace

int plan_command(const PlanOptions& options, const graph::Communicator& ranks) {
  io::Scene scene;
  Bodies bodies;
  try {
    scene = io::load_scene(options.scene, options.overrides);
    append(place_sample(scene).sample, bodies);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  try {
    scene.setup.solver.max_iterations = 1;  // the contacts are wanted, not their impulses
    const int threads = options.threads > 0 ? options.threads
                                            : threads_for(scene, static_cast<std::int64_t>(bodies.size()),
                                                          ranks.ranks(), omp_get_num_procs());
    graph::Executor executor({.threads = threads});
    for (std::size_t k = 0; k < scene.setup.stages.size(); ++k) {
      Setup setup =
          scene.setup;  // each stage by itself, from the initial state: stages differ in what they need
      for (std::size_t earlier = 0; earlier < k; ++earlier)
        for (const auto& [name, load] : scene.setup.stages[earlier].loads)
          for (Wall& wall : setup.walls)
            if (wall.name == name) wall.load = load;
      setup.stages = {scene.setup.stages[k]};
      Simulation simulation(setup, bodies, executor);
      print_out("{}stage '{}', {} thread{}\n", k == 0 ? "" : "\n", scene.setup.stages[k].name, threads,
                threads == 1 ? "" : "s");
      if (!simulation.finished()) simulation.step();
      print_needs(simulation, scene, threads);
      print_costs(simulation);
    }
    constexpr int repeats = 3;
    if (options.measure) print_savings(measure_savings(scene, threads, repeats, ranks), threads, repeats);
  } catch (const NothingToMeasure& error) {
    print_error("talus: error: {}: {}\n", options.scene, error.what());
    return exit_bad_input;
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
  return exit_done;
}

}  // namespace talus
