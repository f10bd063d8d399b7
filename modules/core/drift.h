#pragma once

// How far corrections have moved one map since it joined its group.

#include <optional>

#include "core/server_messages.h"

namespace pangea {

class Drift {
 public:
  // Of the map's corrections, in any order; false for one that is not newer than all before.
  bool Take(const Correction& correction) {
    if (newest_ && correction.revision <= newest_->revision) {
      return false;
    }
    // A lone map starts uncorrected; in a new group the first correction is where the map was put.
    if (!newest_ || newest_->group != correction.group) {
      T_map_odom_first_ = correction.group == correction.map ? Rigid3() : correction.T_map_odom;
    }
    newest_ = correction;
    return true;
  }

  // Metres by which the point of the odom frame has moved.
  double Moved(const Eigen::Vector3d& p_odom) const {
    return newest_ ? (newest_->T_map_odom * p_odom - T_map_odom_first_ * p_odom).norm() : 0;
  }

  const std::optional<Correction>& newest() const { return newest_; }

 private:
  std::optional<Correction> newest_;
  Rigid3 T_map_odom_first_;
};

}  // namespace pangea
