#include "posegraph/graph/received_constraints.h"

namespace pangea {
namespace {

// Saves only the fields of an accepted constraint that the pose graph uses.
void Put(const Constraint& constraint, ByteWriter* writer) {
  writer->Put(constraint.from);
  writer->Put(constraint.to);
  writer->Put(constraint.kind);
  writer->Put(constraint.T_from_to);
  writer->Put(constraint.covariance);
  writer->Put(constraint.num_inliers);
}

void Get(ByteReader* reader, Constraint* constraint) {
  reader->Get(&constraint->from);
  reader->Get(&constraint->to);
  reader->Get(&constraint->kind);
  reader->Get(&constraint->T_from_to);
  reader->Get(&constraint->covariance);
  reader->Get(&constraint->num_inliers);
  constraint->accepted = true;
}

}  // namespace

void ReceivedConstraints::Add(const Constraint& constraint, const Use& use) {
  if (!constraint.accepted || received_.contains(constraint.Id())) {
    return;
  }
  if (use(constraint)) {
    received_.insert(constraint.Id());
  } else if (waiting_.size() < kMaxWaiting) {
    received_.insert(constraint.Id());
    waiting_.push_back(constraint);
  }
}

void ReceivedConstraints::KeyframeCame(const KeyframeId& id, const Use& use) {
  std::erase_if(waiting_, [&](const Constraint& constraint) {
    return (constraint.from == id || constraint.to == id) && use(constraint);
  });
}

void ReceivedConstraints::Save(ByteWriter* writer) const {
  writer->PutCount(waiting_.size());
  for (const Constraint& constraint : waiting_) {
    Put(constraint, writer);
  }
  writer->Put(std::vector<int64_t>(received_.begin(), received_.end()));
}

bool ReceivedConstraints::Restore(ByteReader* reader) {
  waiting_.resize(reader->GetCount(1));
  for (Constraint& constraint : waiting_) {
    Get(reader, &constraint);
  }
  std::vector<int64_t> received;
  reader->Get(&received);
  received_ = {received.begin(), received.end()};
  return reader->ok();
}

}  // namespace pangea
