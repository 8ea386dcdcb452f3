#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/broad_phase.hpp"
#include "kernels/types.hpp"

namespace talus {

/// A grain near a wall.
struct WallPair {
  std::int32_t wall;
  Slot body;
  bool operator==(const WallPair&) const = default;
};

/// Candidates of the broad phase, cut into chunks. Grain pairs come first, sorted by (first, second); then
/// wall pairs, sorted by (wall, body). Candidate k is grain pair k, or wall pair k - grain_pairs.size().
/// `impulse` outlives the step: it is the warm start.
struct Candidates {
  std::vector<GrainPair> grain_pairs;
  std::vector<WallPair> wall_pairs;
  std::vector<double> impulse;  ///< per candidate: 3 components on the first body [N s]; or 1 (along the
                                ///< normal) without friction
  int components = 3;           ///< 3, or 1 without friction

  std::size_t size() const { return grain_pairs.size() + wall_pairs.size(); }
};

/// Chunks are runs of candidates, close in space because bodies are; a chunk never mixes grains and walls,
/// nor two walls. Two chunks conflict when they share a grain, and then differ in colour: the sweep's result
/// depends on colours alone. Example: candidates 0..383 are chunk 0, 384..767 chunk 1, ...; those of wall 0
/// begin a chunk of their own.
struct Chunks {
  std::vector<std::int32_t> begin;   ///< chunks + 1 offsets into the candidates
  std::vector<std::int32_t> wall;    ///< per chunk: index of its wall, or -1
  std::vector<std::int32_t> colour;  ///< per chunk
  int colours = 0;
  std::vector<std::int32_t> body_begin;  ///< chunks + 1 offsets into `bodies`
  std::vector<Slot> bodies;              ///< the grains that a chunk touches, in order of first use
  std::vector<std::uint16_t>
      local;  ///< 2 per candidate: places of its grains in the chunk's list (wall: the second is unused)
  std::vector<std::int32_t> owned_begin;  ///< chunks + 1 offsets into `owned`
  std::vector<Slot>
      owned;  ///< grains of which this chunk is the first to write, in colour order: it resets them
  std::vector<Slot> untouched;               ///< grains without candidates
  std::vector<std::int32_t> conflict_begin;  ///< chunks + 1 offsets into `conflicts`
  std::vector<std::uint32_t> conflicts;      ///< chunks that share a grain, ascending

  std::size_t size() const { return colour.size(); }
};

/// Cuts the candidates into chunks of at most `target` (a few hundred, < 32768), colours them greedily in
/// order, and lists who resets which body.
Chunks cut_chunks(const Candidates& candidates, std::size_t bodies, int target);

/// Carries impulses from `old` to `fresh` where the same pair stands in both; others start from 0. Both are
/// sorted; the slots must mean the same bodies. Impulses are carried between equal `components` only: with
/// friction they are vectors in space, without it normal parts.
void match_impulses(const Candidates& old, Candidates& fresh);

/// Rewrites pairs after bodies were permuted: `place[s]` is the new slot of old slot s. Pairs are sorted
/// anew; an impulse changes sign when the roles of its two bodies change.
void renumber(Candidates& candidates, std::span<const Slot> place);

std::size_t memory_used(const Candidates& candidates);
std::size_t memory_used(const Chunks& chunks);

}  // namespace talus
