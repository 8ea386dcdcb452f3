#pragma once

/// Groups of the contacts of a chunk between grains. They are dealt after a broad phase, then kept and
/// repaired in later steps as long as that works (docs/decisions/0008-lanes.md).

#include <cstddef>
#include <cstdint>
#include <span>

#include "kernels/detection/contacts.hpp"

namespace talus::detail {

/// The candidates of one chunk as they stand in `contacts`, and which of them are contacts in this step.
struct ChunkPlaces {
  const Chunks& chunks;
  std::size_t chunk;
  Contacts& contacts;
  std::span<std::int64_t> contact;  ///< per place, from chunks.begin[chunk] on: 0 if it is no contact
};

/// Deals all contacts to groups, first fit in Chunks::order. There candidates of grains with many candidates
/// come first, which makes groups full. Groups follow from the set of contacts alone.
void deal_groups(const ChunkPlaces& at);

/// Keeps the groups, except for candidates that have become contacts or have ceased to be. A new contact
/// takes the place of an old one if it shares no grain with the rest of that group. Other empty places are
/// filled from the last group, and new contacts that are left join it. The number of groups grows only if the
/// last one is full. False when this fails, or when so many changed that dealing is as cheap: then the groups
/// must be dealt.
bool repair_groups(const ChunkPlaces& at);

}  // namespace talus::detail
