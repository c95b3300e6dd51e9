#include "fault_log.h"

#include <cerrno>
#include <cstring>
#include <numeric>
#include <stdexcept>

#include "whisker_protocol.h"

namespace bridge_sim
{

CsvFile::CsvFile(const std::string &path, const std::string &header) : path_(path)
{
    if (path.empty()) {
        return;
    }
    file_ = std::fopen(path.c_str(), "wx");
    if (!file_) {
        throw std::runtime_error("cannot write '" + path + "': " + std::strerror(errno) + "; choose another name");
    }
    row(header);
}

CsvFile::~CsvFile()
{
    if (file_) {
        std::fclose(file_);
    }
}

void CsvFile::row(const std::string &text)
{
    if (file_) {
        std::fprintf(file_, "%s\n", text.c_str());
    }
}

void CsvFile::flush()
{
    if (file_) {
        std::fflush(file_);
    }
}

void CsvFile::close()
{
    FILE *file = file_;
    file_ = nullptr;
    if (file && std::fclose(file) != 0) {
        throw std::runtime_error("cannot write '" + path_ + "': " + std::strerror(errno));
    }
}

FaultLog::FaultLog(const std::string &lane_path, const std::string &usb_path)
    : lanes_(lane_path, "lane,tick,kind"), usb_(usb_path, "tick,kind")
{
}

void FaultLog::pair(size_t lane, uint64_t tick, const char *kind)
{
    lanes_.row(std::to_string(lane) + "," + std::to_string(tick) + "," + kind);
    pairs_[{lane, tick}] = kind;
}

void FaultLog::lane_fault(const LaneFault &fault)
{
    pair(fault.lane, fault.tick, fault_name(fault.kind));
    if (costs_resync(fault.kind)) {
        pair(fault.lane, fault.tick + WHISKER_LIMIT_RESYNC_TICKS, "resync");
    }
}

void FaultLog::usb_fault(const UsbFault &fault)
{
    usb_.row(std::to_string(fault.tick) + "," + fault_name(fault.kind));
    usb_counts_[static_cast<unsigned>(fault.kind)]++;
}

const std::map<std::pair<size_t, uint64_t>, std::string> &FaultLog::pairs() const
{
    return pairs_;
}

uint64_t FaultLog::usb_count(UsbFaultKind kind) const
{
    return usb_counts_[static_cast<unsigned>(kind)];
}

uint64_t FaultLog::usb_count() const
{
    return std::accumulate(usb_counts_.begin(), usb_counts_.end(), uint64_t{0});
}

void FaultLog::close()
{
    lanes_.close();
    usb_.close();
}

} // namespace bridge_sim
