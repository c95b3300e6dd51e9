// A bridge that misbehaves on purpose, for tests of the host: what it sends is changed on its way to usbfs.
#pragma once

#include <string>
#include <vector>

#include "urb_scheduler.h"

namespace bridge_sim
{

enum class DefectKind {
    NONE,
    WIRE_VERSION, // identity claims the next wire version
    FRAME,        // one bit of one frame's header is wrong
    TRUNCATE      // the end of one frame is missing
};

class Defect
{
  public:
    // Throws std::runtime_error with one line when the name is unknown.
    static DefectKind parse(const std::string &name);

    explicit Defect(DefectKind kind);

    // Changes completed transfers, in the order in which they are handed to the host.
    void spoil(std::vector<Urb> &urbs);

  private:
    void spoil_identity(Urb &urb) const;
    void spoil_frame(Urb &urb);
    void truncate_frame(Urb &urb);

    DefectKind kind_;
    uint64_t bytes_seen_ = 0; // of frames
};

} // namespace bridge_sim
