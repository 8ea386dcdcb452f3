#pragma once

namespace talus {

/// What is known of the answer of a cluster. Each speaks more against one than those before it.
enum class AnswerState : char {
  found,    ///< impulses and velocities satisfy the law but for what is small; impulses that stay, also where
            ///< others would share forces among redundant contacts
  missing,  ///< none was found
  locked,   ///< none was found, and it may be friction that holds grains between closing walls
            ///< (friction_may_lock)
  jammed    ///< there is none: walls close on grains that cannot get away (none_admissible)
};

}  // namespace talus
