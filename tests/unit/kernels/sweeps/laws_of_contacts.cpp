/// Contacts stand in another order than the candidates that they come from, and not every candidate is one:
/// what belongs to a contact has to be that of its own two bodies. Scenes of one material cannot tell.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "kernels/detection/materials.hpp"
#include "kernels/sweeps/cohesion.hpp"
#include "kernels/sweeps/rolling.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::laws_of_contacts_test {
namespace {

constexpr Material grain_materials = 3, material_of_the_box = 3;

/// Numbers that tell every pair of materials from every other.
PairTable unlike_laws() {
  PairTable laws(4);
  for (std::size_t k = 0; k < laws.laws().size(); ++k)
    laws.laws()[k] = {.friction = 0.3,
                      .rolling_resistance = 0.01 * (1 + static_cast<double>(k)),
                      .attraction = {1 + static_cast<double>(k)}};  // cohesion
  return laws;
}

/// Grains of three materials, in no order, in a box of a fourth.
struct MixedSample {
  test::Sample sample;
  PairTable laws = unlike_laws();

  MixedSample() {
    sample.bodies = test::jittered_lattice(6, 11);
    test::Random random(12);
    for (std::size_t k = 0; k < sample.bodies.size(); ++k)
      sample.bodies.material.push_back(static_cast<Material>(random() % grain_materials));
    sample.walls = test::box_of_walls(-0.5, 5.5);
    for (Wall& wall : sample.walls) wall.material = material_of_the_box;
    sample.candidates = test::find_candidates(sample.bodies, sample.walls, 0.1, true);
    sample.candidates.impulse = KeptImpulses(ImpulseKind::rolling);
    sample.candidates.impulse.assign_zeros(sample.candidates.size());
    sample.chunks = cut_chunks(sample.candidates, sample.bodies.size(), 48);
    note_laws(sample.candidates, {sample.bodies.material, sample.walls}, sample.chunks);
    allocate(sample.contacts, sample.candidates, sample.chunks, true);
    sample.contacts.cohesion.resize(sample.candidates.size());
  }

  NarrowPhase narrow_phase() const {
    return {.x = sample.bodies.x,
            .radius = sample.bodies.radius,
            .velocity = sample.bodies.velocity,
            .walls = sample.walls,
            .time_step = 1e-3,
            .alert = 0.05,
            .laws = laws,
            .gravity = Vec3::Zero(),
            .material = sample.bodies.material};
  }
  void find_contacts() {
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      narrow_chunk(narrow_phase(), sample.candidates, sample.chunks, c, InstructionSet::automatic,
                   sample.contacts);
  }
  /// Calls with every contact, the law of its bodies, and the wall at which it is, or null.
  template <class What>
  void for_each_contact(const What& what) const {
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      for (std::size_t k = sample.range(c).begin; k < sample.range(c).end; ++k) {
        const std::int32_t w = sample.chunks.wall[c];
        const Material first = sample.bodies.material[static_cast<std::size_t>(sample.contacts.first[k])];
        const Material second =
            w < 0 ? sample.bodies.material[static_cast<std::size_t>(sample.contacts.second[k])]
                  : material_of_the_box;
        what(k, laws.between(first, second), w < 0 ? nullptr : &sample.walls[static_cast<std::size_t>(w)]);
      }
  }
  /// Contacts whose candidate has another law than the candidate of their own number: those that a mix-up of
  /// the two numbers would give a wrong law.
  int told_apart() const {
    int count = 0;
    const MaterialView materials{sample.bodies.material, sample.walls};
    for_each_contact([&](std::size_t k, const PairLaw& law, const Wall*) {
      count += law_at(laws, sample.candidates, materials, k) == law ? 0 : 1;
    });
    return count;
  }
};

TEST(LawsOfContacts, CohesionIsThatOfTheTwoBodiesThatTouch) {
  MixedSample mixed;
  mixed.find_contacts();
  ASSERT_GT(mixed.told_apart(), 100) << "the sample would not see a mix-up";
  for (std::size_t c = 0; c < mixed.sample.chunks.size(); ++c)
    find_cohesion(mixed.narrow_phase(), mixed.sample.candidates, mixed.sample.chunks, c,
                  mixed.sample.contacts);
  const Bodies& bodies = mixed.sample.bodies;
  int touching = 0, apart = 0;
  mixed.for_each_contact([&](std::size_t k, const PairLaw& law, const Wall* wall) {
    const auto i = static_cast<std::size_t>(mixed.sample.contacts.first[k]);
    double gap, smaller = bodies.radius[i];
    if (wall) {
      gap = wall->normal.dot(bodies.x[i] - wall->point) - bodies.radius[i];
    } else {
      const auto j = static_cast<std::size_t>(mixed.sample.contacts.second[k]);
      gap = (bodies.x[i] - bodies.x[j]).norm() - bodies.radius[i] - bodies.radius[j];
      smaller = std::min(smaller, bodies.radius[j]);
    }
    const bool touches = gap <= CohesionRule{}.reach * smaller;
    ++(touches ? touching : apart);
    EXPECT_NEAR(mixed.sample.contacts.cohesion[k], touches ? law.attraction[0] * 1e-3 : 0, 1e-15) << k;
  });
  EXPECT_GT(touching, 100);
  EXPECT_GT(apart, 10);
}

TEST(LawsOfContacts, RollingResistanceIsThatOfTheTwoBodiesInContact) {
  MixedSample mixed;
  mixed.find_contacts();
  ASSERT_GT(mixed.told_apart(), 100) << "the sample would not see a mix-up";
  for (std::size_t c = 0; c < mixed.sample.chunks.size(); ++c)
    find_arms(mixed.narrow_phase(), mixed.sample.candidates, mixed.sample.chunks, c, mixed.sample.contacts);
  const std::vector<double>& radius = mixed.sample.bodies.radius;
  mixed.for_each_contact([&](std::size_t k, const PairLaw& law, const Wall* wall) {
    const double a = radius[static_cast<std::size_t>(mixed.sample.contacts.first[k])];
    // l is the effective radius: 1/l = 1/a + 1/b, b infinite for a wall.
    const double b = wall ? std::numeric_limits<double>::infinity()
                          : radius[static_cast<std::size_t>(mixed.sample.contacts.second[k])];
    EXPECT_NEAR(mixed.sample.contacts.arm[k], law.rolling_resistance / (1 / a + 1 / b), 1e-15) << k;
  });
}

}  // namespace
}  // namespace talus::laws_of_contacts_test
