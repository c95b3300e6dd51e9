// Writes down each (lane, tick) pair whose record is spoilt, and each USB fault.
#pragma once

#include <array>
#include <cstdio>
#include <map>
#include <string>
#include <utility>

#include "fault_plan.h"

namespace bridge_sim
{

// A CSV file of one run; nothing is written if the path is empty. Throws std::runtime_error if it cannot be written.
class CsvFile
{
  public:
    CsvFile(const std::string &path, const std::string &header);
    ~CsvFile();
    CsvFile(const CsvFile &) = delete;
    CsvFile &operator=(const CsvFile &) = delete;
    void row(const std::string &text);
    void flush(); // what has been written can be read by others
    void close();

  private:
    std::string path_;
    FILE *file_ = nullptr;
};

class FaultLog
{
  public:
    // lane_path: rows lane,tick,kind. usb_path: rows tick,kind. Either may be empty.
    FaultLog(const std::string &lane_path, const std::string &usb_path);

    // The record (lane, tick) will be lost or marked.
    void pair(size_t lane, uint64_t tick, const char *kind);
    void lane_fault(const LaneFault &fault);
    void usb_fault(const UsbFault &fault);

    // Every pair (lane, tick) so far, and the kind of its fault.
    const std::map<std::pair<size_t, uint64_t>, std::string> &pairs() const;
    uint64_t usb_count(UsbFaultKind kind) const;
    uint64_t usb_count() const;
    void close();

  private:
    CsvFile lanes_;
    CsvFile usb_;
    std::map<std::pair<size_t, uint64_t>, std::string> pairs_;
    std::array<uint64_t, USB_FAULT_KINDS> usb_counts_{};
};

} // namespace bridge_sim
