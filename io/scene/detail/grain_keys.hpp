#pragma once

#include "io/scene/detail/scene_key.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// Keys of grains that come and go.
Section<InsertRule> insert_keys();
Section<RemoveRule> remove_keys();

}  // namespace talus::io::detail
