#pragma once

// What the pages look at: a bus, live, or a log with its controls. All pages of one server look at
// the same time of it.

#include <cstdint>
#include <string>
#include <vector>

#include "viewer/anchor_change.h"
#include "viewer/scene/scene.h"

namespace pangea::viewer {

// Seconds since the start of what is shown.
struct ShowClock {
  bool live = true;
  double now_s = 0;
  double end_s = 0;  // of a log
  bool playing = true;
  double speed = 1;
};

class Show {
 public:
  virtual ~Show() = default;

  virtual const Scene& scene() const = 0;
  // Another number: another scene, all of it is to be sent anew.
  virtual int64_t epoch() const = 0;
  virtual ShowClock clock() const = 0;
  // The bus' URL or the log's file name, for people.
  virtual std::string source() const = 0;
  // The whole log's, for marks on its slider.
  virtual std::vector<Fusion> all_fusions() const { return {}; }

  // Whether pages may change anchors; of a log nobody may.
  virtual bool editable() const { return false; }
  // What cannot be done is told to all pages (Scene::Tell).
  virtual void Change(const AnchorChange&) {}

  virtual void Seek(double) {}
  virtual void Play(bool) {}
  virtual void SetSpeed(double) {}
};

}  // namespace pangea::viewer
