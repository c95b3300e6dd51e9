/* How sure the robot is of its place, and why. */
const SURE = 0.9; // of the belief near the estimate: the share that the regions of 90 % are drawn for
const LOST = 0.5; // less is near the estimate than in all other places
const UNREAD_S = 5; // rows of 0.1 s without a reading come in every run: a whisk takes some seconds

/* [level, text] for the header; null: no pose is known. `ring`: topic status, undefined where none is looked at. */
function sureness(word, world, ring) {
  if (!word.pose || word.pose.confidence === null) return null;
  const why = reasons(word, world.belief, ring);
  const share = word.pose.confidence;
  if (share >= SURE && !why.length) return ['sure', `● sure: ± ${signed(word.pose.sigma_m, 2)} m`];
  if (share < SURE) why.push(world.belief.modes.length > 1 ? `belief in ${world.belief.modes.length} places` : `${Math.round(100 * share)} % of the belief near`);
  const found = world.path.some((point) => point[4] >= SURE);
  if (!found) return ['searching', `○ not found yet: ${why.join(', ')}`];
  return share < LOST ? ['lost', `■ lost: ${why.join(', ')}`] : ['losing', `▲ losing it: ${why.join(', ')}`];
}

function reasons(word, belief, ring) {
  const why = [];
  if (word.ages.pose > AGED_S) why.push(`no pose for ${duration(word.ages.pose)}`);
  if (word.unread_s >= UNREAD_S) why.push(`nothing read for ${duration(word.unread_s)}`);
  if (ring?.state === 'live' && ring.loss) why.push(`${(100 * ring.loss[0]).toPrecision(2)} % of samples dropped`);
  return why;
}
