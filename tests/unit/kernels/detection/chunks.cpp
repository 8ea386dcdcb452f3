#include "kernels/detection/chunks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "kernels/bodies/index.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

using test::Random;
using test::uniform;

/// Grains that candidate k writes.
std::vector<Slot> grains_of(const Candidates& candidates, std::size_t k) {
  const std::size_t grains = candidates.grain_pairs.size();
  if (k < grains) return {candidates.grain_pairs[k].first, candidates.grain_pairs[k].second};
  return {candidates.wall_pairs[k - grains].body};
}

std::set<Slot> grains_of_chunk(const Candidates& candidates, const Chunks& chunks, std::size_t c) {
  std::set<Slot> grains;
  for (std::size_t k = at(chunks.begin[c]); k < at(chunks.begin[c + 1]); ++k)
    for (Slot s : grains_of(candidates, k)) grains.insert(s);
  return grains;
}

struct Case {
  std::string name;
  Candidates candidates;
  std::size_t bodies;
  int target;
};

std::vector<Case> cases() {
  std::vector<Case> list;
  for (int target : {1, 7, 48, 384}) {
    const Bodies bodies = test::jittered_lattice(7, 3);
    list.push_back({"lattice in walls, target " + std::to_string(target),
                    test::find_candidates(bodies, test::box_of_walls(-0.5, 6.5), 0.05, true), bodies.size(),
                    target});
  }
  list.push_back({"nothing", {}, 0, 100});
  list.push_back({"bodies that touch nothing", {}, 5, 100});
  Candidates star;  // a large grain among small ones: every chunk conflicts with every other
  for (Slot s = 1; s < 200; ++s) star.grain_pairs.push_back({0, s});
  list.push_back({"star", star, 203, 16});
  Candidates walls;  // grains between two walls only
  for (std::int32_t w : {1, 4})
    for (Slot s = 0; s < 33; ++s) walls.wall_pairs.push_back({w, s});
  list.push_back({"walls", walls, 33, 10});
  return list;
}

TEST(Chunks, CoverEveryCandidateOnceAndMixNoWalls) {
  for (const Case& given : cases()) {
    SCOPED_TRACE(given.name);
    const Chunks chunks = cut_chunks(given.candidates, given.bodies, given.target);
    ASSERT_EQ(chunks.begin.size(), chunks.size() + 1);
    EXPECT_EQ(chunks.begin.front(), 0);
    EXPECT_EQ(at(chunks.begin.back()), given.candidates.size());
    const std::size_t grains = given.candidates.grain_pairs.size();
    for (std::size_t c = 0; c < chunks.size(); ++c) {
      EXPECT_LT(chunks.begin[c], chunks.begin[c + 1]);
      EXPECT_LE(chunks.begin[c + 1] - chunks.begin[c], given.target);
      for (std::size_t k = at(chunks.begin[c]); k < at(chunks.begin[c + 1]); ++k)
        EXPECT_EQ(chunks.wall[c], k < grains ? -1 : given.candidates.wall_pairs[k - grains].wall);
    }
  }
}

TEST(Chunks, LocalPlacesPointToTheGrainsOfEachCandidate) {
  for (const Case& given : cases()) {
    SCOPED_TRACE(given.name);
    const Chunks chunks = cut_chunks(given.candidates, given.bodies, given.target);
    for (std::size_t c = 0; c < chunks.size(); ++c) {
      const std::vector<Slot> listed(chunks.bodies.begin() + chunks.body_begin[c],
                                     chunks.bodies.begin() + chunks.body_begin[c + 1]);
      const std::set<Slot> grains = grains_of_chunk(given.candidates, chunks, c);
      EXPECT_EQ(std::set<Slot>(listed.begin(), listed.end()), grains);
      EXPECT_EQ(listed.size(), grains.size()) << "a grain is listed twice";
      for (std::size_t k = at(chunks.begin[c]); k < at(chunks.begin[c + 1]); ++k) {
        const std::vector<Slot> own = grains_of(given.candidates, k);
        for (std::size_t side = 0; side < own.size(); ++side)
          EXPECT_EQ(listed.at(chunks.local[2 * k + side]), own[side]);
      }
    }
  }
}

TEST(Chunks, ConflictsAreThePairsThatShareAGrainAndDifferInColour) {
  for (const Case& given : cases()) {
    SCOPED_TRACE(given.name);
    const Chunks chunks = cut_chunks(given.candidates, given.bodies, given.target);
    std::vector<std::set<Slot>> grains;
    for (std::size_t c = 0; c < chunks.size(); ++c)
      grains.push_back(grains_of_chunk(given.candidates, chunks, c));
    std::int32_t colours = 0;
    for (std::size_t a = 0; a < chunks.size(); ++a) {
      std::vector<std::uint32_t> expected;
      for (std::size_t b = 0; b < chunks.size(); ++b) {
        const bool shared = a != b && std::any_of(grains[a].begin(), grains[a].end(),
                                                  [&](Slot s) { return grains[b].count(s) > 0; });
        if (!shared) continue;
        expected.push_back(static_cast<std::uint32_t>(b));
        EXPECT_NE(chunks.colour[a], chunks.colour[b]) << "chunks " << a << " and " << b;
      }
      const std::vector<std::uint32_t> found(chunks.conflicts.begin() + chunks.conflict_begin[a],
                                             chunks.conflicts.begin() + chunks.conflict_begin[a + 1]);
      EXPECT_EQ(found, expected);
      EXPECT_GE(chunks.colour[a], 0);
      colours = std::max(colours, chunks.colour[a] + 1);
    }
    EXPECT_EQ(chunks.colours, colours);
  }
}

TEST(Chunks, EachGrainIsResetOnceByTheFirstChunkThatWritesIt) {
  for (const Case& given : cases()) {
    SCOPED_TRACE(given.name);
    const Chunks chunks = cut_chunks(given.candidates, given.bodies, given.target);
    std::vector<int> reset(given.bodies, 0), lowest(given.bodies, chunks.colours);
    for (std::size_t c = 0; c < chunks.size(); ++c)
      for (Slot s : grains_of_chunk(given.candidates, chunks, c))
        lowest[at(s)] = std::min(lowest[at(s)], chunks.colour[c]);
    for (std::size_t c = 0; c < chunks.size(); ++c)
      for (auto k = chunks.owned_begin[c]; k < chunks.owned_begin[c + 1]; ++k) {
        const Slot s = chunks.owned[at(k)];
        ++reset[at(s)];
        EXPECT_EQ(chunks.colour[c], lowest[at(s)]) << "grain " << s;
      }
    for (Slot s : chunks.untouched) {
      ++reset[at(s)];
      EXPECT_EQ(lowest[at(s)], chunks.colours) << "grain " << s << " is touched";
    }
    EXPECT_EQ(reset, std::vector<int>(given.bodies, 1));
  }
}

TEST(Chunks, LateOnesComeBehindTheInsideAndResetNoBodyThatIsTaken) {
  // Bodies 0..9 in a row: pairs 0-2 at the border, 3-5 inside, 6-8 at the border and late.
  Candidates row;
  for (Slot s = 0; s < 9; ++s) row.grain_pairs.push_back({s, s + 1});
  const std::vector<CandidateGroup> groups = {{0, 3, -1, 0, ChunkSide::border, 1},
                                              {3, 6, -1, 0, ChunkSide::inside, 1},
                                              {6, 9, -1, 0, ChunkSide::late, 1}};
  std::vector<char> taken(10, 0);
  taken[8] = 1;
  const Chunks chunks = cut_chunks(row, groups, 10, taken);
  for (std::size_t before = 0; before < 3; ++before)
    for (std::size_t behind = before + 1; behind < 3; ++behind)
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b)
          EXPECT_LT(chunks.colour[3 * before + a], chunks.colour[3 * behind + b]);
  std::vector<Slot> reset = chunks.owned;
  std::sort(reset.begin(), reset.end());
  EXPECT_EQ(reset, (std::vector<Slot>{0, 1, 2, 3, 4, 5, 6, 7, 9}));
  EXPECT_TRUE(chunks.untouched.empty());
}

/// Part of the pairs, with impulses that tell where they came from.
Candidates some_of(const Candidates& all, double share, std::uint64_t seed) {
  Random random(seed);
  Candidates some;
  some.impulse = KeptImpulses(all.impulse.kind());
  for (const GrainPair& pair : all.grain_pairs)
    if (uniform(random, 0, 1) < share) some.grain_pairs.push_back(pair);
  for (const WallPair& pair : all.wall_pairs)
    if (uniform(random, 0, 1) < share) some.wall_pairs.push_back(pair);
  some.impulse.assign_zeros(some.size());
  for (double& value : some.impulse.values()) value = uniform(random, -1, 1);
  return some;
}

using Impulse = std::vector<double>;
using Key = std::pair<std::int64_t, std::int64_t>;

/// Impulses by pair; a wall is a negative number.
std::map<Key, Impulse> impulses_by_pair(const Candidates& candidates) {
  std::map<Key, Impulse> map;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const std::size_t grains = candidates.grain_pairs.size();
    const Key key =
        k < grains ? Key{candidates.grain_pairs[k].first, candidates.grain_pairs[k].second}
                   : Key{-1 - candidates.wall_pairs[k - grains].wall, candidates.wall_pairs[k - grains].body};
    const auto row = candidates.impulse.row(k);
    map[key] = Impulse(row.begin(), row.end());
  }
  return map;
}

TEST(MatchImpulses, AgreesWithALookUpByPair) {
  for (bool friction : {false, true}) {
    const Bodies bodies = test::jittered_lattice(6, 8);
    const Candidates all = test::find_candidates(bodies, test::box_of_walls(-0.5, 5.5), 0.1, friction);
    const Candidates old = some_of(all, 0.7, 1);
    Candidates fresh = some_of(all, 0.6, 2);
    const auto known = impulses_by_pair(old);
    match_impulses(old, fresh);
    int carried = 0, started = 0;
    for (const auto& [key, impulse] : impulses_by_pair(fresh)) {
      const auto before = known.find(key);
      const Impulse zero(impulse.size(), 0.0);
      EXPECT_EQ(impulse, before == known.end() ? zero : before->second);
      ++(before == known.end() ? started : carried);
    }
    EXPECT_GT(carried, 100);
    EXPECT_GT(started, 100);
  }
}

TEST(MatchImpulses, StartsFromZeroWhenFrictionIsSwitched) {
  const Bodies bodies = test::jittered_lattice(4, 8);
  const Candidates old = some_of(test::find_candidates(bodies, {}, 0.1, false), 1, 1);
  Candidates fresh = test::find_candidates(bodies, {}, 0.1, true);
  match_impulses(old, fresh);
  EXPECT_EQ(fresh.impulse.size(), fresh.size());
  EXPECT_TRUE(std::ranges::all_of(fresh.impulse.values(), [](double value) { return value == 0; }));
}

TEST(Renumber, KeepsTheImpulseThatEachBodyFeels) {
  for (bool friction : {false, true}) {
    const Bodies bodies = test::jittered_lattice(6, 4);
    const Candidates before =
        some_of(test::find_candidates(bodies, test::box_of_walls(-0.5, 5.5), 0.1, friction), 0.8, 6);
    std::vector<Slot> place(bodies.size());
    std::iota(place.begin(), place.end(), 0);
    Random random(12);
    std::shuffle(place.begin(), place.end(), random);
    Candidates after = before;
    renumber(after, place);

    EXPECT_TRUE(std::is_sorted(after.grain_pairs.begin(), after.grain_pairs.end(),
                               [](const GrainPair& a, const GrainPair& b) {
                                 return std::pair(a.first, a.second) < std::pair(b.first, b.second);
                               }));
    EXPECT_TRUE(std::is_sorted(after.wall_pairs.begin(), after.wall_pairs.end(),
                               [](const WallPair& a, const WallPair& b) {
                                 return std::pair(a.wall, a.body) < std::pair(b.wall, b.body);
                               }));
    const auto found = impulses_by_pair(after);
    ASSERT_EQ(found.size(), before.size());
    for (const auto& [key, impulse] : impulses_by_pair(before)) {
      const bool wall = key.first < 0;
      Key moved{wall ? key.first : place[static_cast<std::size_t>(key.first)],
                place[static_cast<std::size_t>(key.second)]};
      Impulse expected = impulse;
      if (!wall && moved.first > moved.second) {  // now on the other body: minus as a vector, the same along
        std::swap(moved.first, moved.second);     // a normal that turns round with it
        if (friction)
          for (double& r : expected) r = -r;
      }
      EXPECT_EQ(found.at(moved), expected);
    }
  }
}

}  // namespace
}  // namespace talus
