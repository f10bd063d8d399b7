#pragma once

// The cores of the server over many visits, with their journal; after a thinning they start again
// from the thinned journal.

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "bench/process_use.h"
#include "core/keyframe.h"
#include "core/server_messages.h"
#include "loop_verification/loop_verifier.h"
#include "place_recognition/place_recognition.h"
#include "posegraph/posegraph.h"
#include "thinning/thinning.h"

namespace pangea::bench {

struct Journal {
  struct Entry {
    Keyframe keyframe;
    PlaceMatch match;
    int64_t journalled_utime = 0;
  };
  std::vector<std::vector<Entry>> maps;  // the oldest map first; ascending seq
  std::map<int64_t, Constraint> constraints;

  size_t num_keyframes() const;
  size_t num_accepted() const;
  // Thins the journal as pangea-site does; returns the removed keyframes and the new constraints.
  ThinnedMaps Thin(const Thinning::Options& options, int64_t now_utime);
};

class Server {
 public:
  // Starts from the contents of a journal.
  explicit Server(const Journal& journal);

  // Processes a keyframe from an agent, and adds it with its results to the journal. Returns the
  // results of its candidates.
  std::vector<Constraint> Take(const Keyframe& keyframe, Journal* journal);
  // Solves every group from the beginning.
  void Finish();

  // By process; cpu_ms is that since the last call.
  std::map<std::string, Use> TakeUse() { return use_.Take(); }
  std::vector<MapState> States() const { return graph_->States(); }

 private:
  Constraint Verify(const KeyframeId& query, const PlaceCandidate& candidate);
  void TellGroups(const PoseGraphUpdate& update);

  std::unique_ptr<PlaceRecognition> recognition_;
  std::unique_ptr<LoopVerifier> inter_map_ba_;
  std::unique_ptr<LoopVerifier> fusion_;
  std::unique_ptr<PoseGraph> graph_;
  UseByProcess use_;
};

}  // namespace pangea::bench
