#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/detection/broad_phase.hpp"
#include "kernels/detection/kept_impulses.hpp"

namespace talus {

/// A grain near a wall, or near one feature of its surface (kernels/shapes/surface.hpp); 0 at a plane.
struct WallPair {
  std::int32_t wall;
  Slot body;
  std::int32_t feature = 0;
  bool operator==(const WallPair&) const = default;
};

/// Candidates of the broad phase, cut into chunks. Grain pairs come first, sorted by (first, second); then
/// wall pairs, sorted by (wall, layer, body): the first features of all grains at a wall are its first layer,
/// the second features the next, so that no layer has a grain twice. A plane has one layer. Candidate k is
/// grain pair k, or wall pair k - grain_pairs.size(). `impulse` outlives the step: it is the warm start.
struct Candidates {
  std::vector<GrainPair> grain_pairs;
  std::vector<WallPair> wall_pairs;
  std::vector<std::uint16_t> balls;  ///< per grain pair: number of a ball of the first x 256 + that of one of
                                     ///< the second; then pairs are sorted by (first, second, balls). Empty
                                     ///< where no body is a clump (split_into_balls)
  KeptImpulses impulse;              ///< per candidate; its kind is that of the stage

  std::size_t size() const { return grain_pairs.size() + wall_pairs.size(); }
};

/// When a chunk is swept: in this order. Messages with what a chunk leaves at the interface, and messages
/// that a late chunk waits for, travel while other chunks are swept.
enum class ChunkSide : std::uint8_t {
  wall,    ///< at a glued wall
  border,  ///< each of its candidates has a body that stands in several subdomains
  inside,  ///< none of its bodies stands in another subdomain
  late,    ///< a border that is swept only when messages of other subdomains have come
};

/// Candidates [begin, end) that may share a chunk: of one subdomain, of one layer at one wall or of none, and
/// of one side. Groups follow one another, and together hold all candidates.
struct CandidateGroup {
  std::int32_t begin;
  std::int32_t end;
  std::int32_t wall;       ///< index of the wall, or -1
  std::int32_t subdomain;  ///< index among those of this process
  ChunkSide side;
  int target;  ///< candidates in a chunk at most; 64 to longest_chunk make good groups, < 32768 is possible
};

/// The contacts of longer chunks may not fit the groups that are open at once while contacts are dealt to
/// groups.
inline constexpr int longest_chunk = 1000;

/// Bound so that 32 bits can tell where the record of a body begins (ContactBody).
inline constexpr std::size_t most_bodies_of_a_process = std::size_t{1} << 29;

/// The candidates of a chunk are of several pairs of materials.
inline constexpr std::int32_t mixed_laws = -1;

/// The kind of a chunk's candidates decides how they are swept. Spheres in a chunk of blocks are blocks, too.
enum class ChunkKind : std::uint8_t {
  spheres,       ///< between spheres
  spheres_wall,  ///< spheres at one wall
  blocks,        ///< a clump is among the bodies (note_kinds): at one wall, or none
};

/// Chunks are runs of candidates, close in space because bodies are sorted so. A chunk never mixes groups,
/// and so neither grains and walls nor two walls. Chunks of a side have colours above those of the sides
/// before it. Two chunks conflict when they share a grain, and then differ in colour: the sweep's result
/// depends on colours alone. Example: candidates 0..383 are chunk 0, 384..767 chunk 1, ...; those of wall 0
/// begin a chunk of their own.
struct Chunks {
  std::vector<std::int32_t> begin;      ///< chunks + 1 offsets into the candidates
  std::vector<std::int32_t> wall;       ///< per chunk: index of its wall, or -1
  std::vector<std::int32_t> subdomain;  ///< per chunk: that of its group
  std::vector<ChunkSide> side;          ///< per chunk: that of its group
  std::vector<ChunkKind> kind;          ///< per chunk
  std::vector<std::int32_t> law;     ///< per chunk: number of the law of all its candidates (PairTable), or
                                     ///< mixed_laws (note_laws)
  std::vector<std::int32_t> colour;  ///< per chunk
  int colours = 0;
  std::vector<std::int32_t> body_begin;  ///< chunks + 1 offsets into `bodies`
  std::vector<Slot> bodies;              ///< the grains that a chunk touches, in order of first use
  std::vector<std::uint16_t>
      local;  ///< 2 per candidate: places of its grains in the chunk's list (wall: the second is unused)
  std::vector<std::uint16_t> order;       ///< per grain pair, from begin[c] on: candidates of chunk c, less
                                          ///< begin[c], in the order in which groups are filled
  std::vector<std::int32_t> owned_begin;  ///< chunks + 1 offsets into `owned`
  std::vector<Slot> owned;  ///< grains that this chunk is the first to write, in colour order: it resets them
  std::vector<Slot> untouched;               ///< grains without candidates, which no chunk resets
  std::vector<std::int32_t> conflict_begin;  ///< chunks + 1 offsets into `conflicts`
  std::vector<std::uint32_t> conflicts;      ///< chunks that share a grain, ascending

  std::size_t size() const { return colour.size(); }
};

/// Cuts the groups into chunks, colours them greedily in order, and lists which chunk resets which body. No
/// chunk resets bodies that are `taken` (per body, or empty): their velocities come from elsewhere before a
/// chunk writes them. Until note_laws, laws are those of a scene that names no materials. Throws
/// std::runtime_error when there are more than most_bodies_of_a_process.
Chunks cut_chunks(const Candidates& candidates, std::span<const CandidateGroup> groups, std::size_t bodies,
                  std::span<const char> taken = {});

/// The same with all candidates of one subdomain and nothing glued.
Chunks cut_chunks(const Candidates& candidates, std::size_t bodies, int target);

/// The groups of candidates that are all of one subdomain, in the order of `Candidates`. Pairs at walls with
/// `glued[wall]` get ChunkSide::wall (none when `glued` is empty).
std::vector<CandidateGroup> groups_of_one_subdomain(const Candidates& candidates, std::span<const char> glued,
                                                    int target);

/// Carries impulses from `old` to `fresh` where the same pair stands in both; others start from 0. Both are
/// sorted; the slots must mean the same bodies. Impulses are carried between equal kinds only: with
/// friction they are vectors in space, without it normal parts.
void match_impulses(const Candidates& old, Candidates& fresh);

/// Rewrites pairs after bodies were permuted: `place[s]` is the new slot of old slot s. Pairs are sorted
/// anew; an impulse changes sign when the roles of its two bodies change.
void renumber(Candidates& candidates, std::span<const Slot> place);

std::size_t memory_used(const Candidates& candidates);
std::size_t memory_used(const Chunks& chunks);

}  // namespace talus
