#pragma once

/// Which contacts of a chunk between grains stand in one group: dealt behind a broad phase, then kept and
/// repaired while that can be done (docs/decisions/0008-lanes.md).

#include <cstddef>
#include <cstdint>
#include <span>

#include "kernels/detection/contacts.hpp"

namespace talus::detail {

/// The candidates of one chunk as they stand in `contacts`, and what they are in this step.
struct ChunkPlaces {
  const Chunks& chunks;
  std::size_t chunk;
  Contacts& contacts;
  std::span<std::int64_t> contact;  ///< per place, from chunks.begin[chunk] on: 0 for what is none
};

/// Deals all contacts to groups, first fit in Chunks::order: candidates of grains with many candidates come
/// first, which is what makes groups full. Groups follow from the set of contacts alone.
void deal_groups(const ChunkPlaces& at);

/// Keeps the groups but for those contacts that came or went: one that came takes the place of one that went
/// where it shares no grain with the rest of the group; other places are filled from the last group, and what
/// is left joins it. There is no group more than before unless the last was full. False when that does not
/// work out, or so many changed that dealing is as cheap: then the groups must be dealt.
bool repair_groups(const ChunkPlaces& at);

}  // namespace talus::detail
