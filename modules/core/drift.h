#pragma once

// How far corrections have moved one map since it joined its group.

#include <optional>

#include "core/server_messages.h"

namespace pangea {

class Drift {
 public:
  // Takes a correction of the map; corrections may come in any order. False, and nothing changes,
  // unless it is newer than all before.
  bool Take(const Correction& correction) {
    if (newest_ && correction.revision <= newest_->revision) {
      return false;
    }
    // The oldest map of a group starts uncorrected. Any other map starts where the first correction
    // of the new group puts it.
    if (!newest_ || newest_->group != correction.group) {
      T_map_odom_first_ = correction.group == correction.map ? Rigid3() : correction.T_map_odom;
    }
    newest_ = correction;
    return true;
  }

  // Metres by which corrections have moved the point `p_odom`.
  double Moved(const Eigen::Vector3d& p_odom) const {
    return newest_ ? (newest_->T_map_odom * p_odom - T_map_odom_first_ * p_odom).norm() : 0;
  }

  const std::optional<Correction>& newest() const { return newest_; }

 private:
  std::optional<Correction> newest_;
  Rigid3 T_map_odom_first_;
};

}  // namespace pangea
