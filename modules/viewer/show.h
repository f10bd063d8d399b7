#pragma once

// The source that the pages show: a live bus, or a log with player controls. All pages of one
// server show the same time.

#include <cstdint>
#include <string>
#include <vector>

#include "viewer/anchor_change.h"
#include "viewer/scene/scene.h"

namespace pangea::viewer {

// Times are seconds since the start of the bus' show or of the log.
struct ShowClock {
  bool live = true;
  double now_s = 0;
  double end_s = 0;  // end of a log
  bool playing = true;
  double speed = 1;
};

class Show {
 public:
  virtual ~Show() = default;

  virtual const Scene& scene() const = 0;
  // A number that changes when the scene was built again; then all of it must be sent again.
  virtual int64_t epoch() const = 0;
  virtual ShowClock clock() const = 0;
  // The bus' URL or the log's file name, for people.
  virtual std::string source() const = 0;
  // The fusions of the whole log, for marks on its slider.
  virtual std::vector<Fusion> all_fusions() const { return {}; }

  // Whether pages may change anchors; never those of a log.
  virtual bool editable() const { return false; }
  // If the change is not possible, all pages are told (Scene::Tell).
  virtual void Change(const AnchorChange&) {}

  virtual void Seek(double) {}
  virtual void Play(bool) {}
  virtual void SetSpeed(double) {}
};

}  // namespace pangea::viewer
