#include "place_recognition/place_recognition_process.h"
#include "server_process/process_main.h"

// KEYFRAME_*, MAP_STATE, HAVE --> PlaceRecognitionProcess --> PLACE_MATCH
int main(int argc, char** argv) {
  return pangea::ServerProcessMain<pangea::PlaceRecognitionProcess,
                                   pangea::PlaceRecognitionOptions>(
      argc, argv, "pangea-place-recognition",
      "Finds, for each keyframe, the older keyframes of all maps that show the same place");
}
