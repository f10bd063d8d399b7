#pragma once

// Poses and relative poses in a checkpoint (core/byte_record.h).

#include "core/byte_record.h"
#include "posegraph/solver/four_dof.h"

namespace pangea {

inline void Put(const Pose4& pose, ByteWriter* writer) {
  writer->Put(pose.p);
  writer->Put(pose.yaw);
}

inline void Get(ByteReader* reader, Pose4* pose) {
  reader->Get(&pose->p);
  reader->Get(&pose->yaw);
}

inline void Put(const Relative4& relative, ByteWriter* writer) {
  writer->Put(relative.t);
  writer->Put(relative.yaw);
  writer->Put(relative.covariance);
}

inline void Get(ByteReader* reader, Relative4* relative) {
  reader->Get(&relative->t);
  reader->Get(&relative->yaw);
  reader->Get(&relative->covariance);
}

}  // namespace pangea
