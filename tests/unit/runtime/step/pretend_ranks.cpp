/// Whole simulations on ranks that pretend: what mpirun would run, in one process.

#include "runtime/graph/pretend_ranks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>

#include "runtime/graph/delayed_messages.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

/// Velocity (u, w) of each grain, by its number.
using Velocities = std::map<BodyId, std::vector<double>>;

/// 343 grains that overlap, of one density.
Sample jittered_sample() {
  const Bodies bodies = test::jittered_lattice(7, 4, 0.1);
  Sample sample;
  sample.x = bodies.x;
  sample.radius = bodies.radius;
  sample.density = 2000;
  for (const Velocity& v : bodies.velocity) {
    auto& numbers = sample.velocity.emplace_back();
    std::copy_n(v.u, 3, numbers.begin());
    std::copy_n(v.w, 3, numbers.begin() + 3);
  }
  return sample;
}

/// Pressed between walls of finite mass, in six subdomains.
talus::Setup pressed_grains(ExchangeScheme exchange) {
  talus::Setup setup = test::pressed_setup(test::box_of_walls(-1, 7), 0.3, 3, 1e4, 200);
  setup.decomposition.subdomains = 6;
  setup.decomposition.exchange = exchange;
  setup.solver.max_iterations = 60;
  return setup;
}

/// At the end; copies of a grain must agree.
Velocities simulate(const talus::Setup& setup, const graph::Communicator& ranks) {
  graph::Executor executor({.threads = 1});
  Sample sample = ranks.rank() == 0 ? jittered_sample() : Sample{};
  Simulation simulation(setup, deal_out(std::move(sample), setup.decomposition, ranks), executor, ranks);
  for (; !simulation.finished(); simulation.begin_next_stage()) simulation.step();
  Velocities own;
  const Bodies& bodies = simulation.state().bodies;
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    std::vector<double> numbers(bodies.velocity[k].u, bodies.velocity[k].u + 3);
    numbers.insert(numbers.end(), bodies.velocity[k].w, bodies.velocity[k].w + 3);
    const auto [place, is_new] = own.try_emplace(bodies.id[k], numbers);
    EXPECT_TRUE(is_new || place->second == numbers) << "copies of grain " << static_cast<int>(place->first);
  }
  return own;
}

/// The grains of all ranks.
Velocities simulate_on(int count, const talus::Setup& setup, double delay = 0) {
  Velocities all;
  std::mutex adding;
  graph::on_pretend_ranks(count, [&](const graph::Communicator& ranks) {
    const std::shared_ptr<const graph::Communicator> borrowed(std::shared_ptr<void>(), &ranks);
    const graph::DelayedMessages late(borrowed, delay);
    const Velocities own = simulate(setup, delay > 0 ? late : ranks);
    const std::lock_guard lock(adding);
    for (const auto& [id, velocity] : own) {
      const auto [place, is_new] = all.try_emplace(id, velocity);
      EXPECT_TRUE(is_new || place->second == velocity) << "grain " << static_cast<int>(id);
    }
  });
  return all;
}

TEST(PretendedSimulation, GivesTheBitsOfOneRank) {
  for (const ExchangeScheme exchange : {ExchangeScheme::dcs, ExchangeScheme::ccs}) {
    const talus::Setup setup = pressed_grains(exchange);
    const Velocities expected = simulate(setup, graph::one_rank());
    ASSERT_EQ(expected.size(), 343U);
    for (const int count : {1, 2, 3, 6})
      EXPECT_EQ(simulate_on(count, setup), expected) << count << " ranks, " << static_cast<int>(exchange);
  }
}

TEST(PretendedSimulation, GivesTheSameBitsHoweverLateMessagesCome) {
  const talus::Setup setup = pressed_grains(ExchangeScheme::dcs);
  EXPECT_EQ(simulate_on(3, setup, 1e-4), simulate(setup, graph::one_rank()));
}

}  // namespace
}  // namespace talus
