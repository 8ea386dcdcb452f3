#pragma once

/// What the ranks of a run agree on before its first step, and how they end together when one fails.

#include <functional>
#include <string>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/setup.hpp"

namespace talus {

/// Collective. Shares what rank 0 alone knows when it has made the sample: where the walls stand, how
/// they move, what they weigh, the stress of a state, and the ids of bodies with names.
void share_start(Setup& setup, const graph::Communicator& ranks);

/// Collective. True when any rank refuses to run: `why` says it for this one, "" when it does not. Rank 0
/// speaks on stderr for all: of itself, or else says each sentence once.
bool any_refused(const std::string& why, const graph::Communicator& ranks);

/// Ends all ranks of a run that failed on this rank of several. Rank 0 has tables and run.json to write, in
/// the middle of which it must not be killed: the others wait for it, but only seconds, since it may wait for
/// them, and then nobody but `alone` says why the run ended. It waits a moment for what they have to say.
/// Does not return.
void end_all(int code, const graph::Communicator& ranks, const std::function<void()>& alone = {});

}  // namespace talus
