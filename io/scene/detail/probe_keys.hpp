#pragma once

#include "io/scene/detail/scene_key.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// Keys of probes and fields.
Section<ProbeRule> probe_keys();
Section<FieldRule> field_keys();

}  // namespace talus::io::detail
