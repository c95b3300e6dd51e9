#!/bin/busybox sh
# First process of the services' guest: modules, Debian's files with what is installed over them, then systemd.
export PATH=/bin
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
while read -r module; do insmod "/modules/$module" || echo "guest: module $module did not load"; done </modules/order
ip link set eth0 up && ip addr add 10.0.2.15/24 dev eth0
mkdir /debian /changes /root
mount -t squashfs -o ro /dev/vda /debian
mount -t tmpfs changes /changes
mkdir /changes/upper /changes/work
cp -a /layer/. /changes/upper/
mount -t overlay -o lowerdir=/debian,upperdir=/changes/upper,workdir=/changes/work overlay /root
umount /proc /sys
mount --move /dev /root/dev
exec switch_root /root /sbin/init
