//! The style sheet of the pages.

/// Inline CSS: one column of text, figures two abreast where they fit, rules in place of boxes.
pub(super) const STYLE: &str = "
:root { color-scheme: light; --ink: #22262b; --soft: #5a616a; --rule: #d9dce0; --faint: #f5f6f7; --warm: #8a5a00; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: var(--ink); font: 16px/1.55 system-ui, -apple-system, 'Segoe UI', \
'Helvetica Neue', Arial, sans-serif; -webkit-text-size-adjust: 100%; }
main { max-width: 1120px; margin: 0 auto; padding: 2.5rem 1.5rem 4rem; }
.kicker { margin: 0; color: var(--soft); font-size: .8rem; letter-spacing: .08em; text-transform: uppercase; }
h1 { margin: .1rem 0 .2rem; font-size: 2.1rem; line-height: 1.2; font-weight: 650; letter-spacing: -.01em; \
overflow-wrap: anywhere; }
h2 { margin: 2.8rem 0 .9rem; font-size: 1.2rem; font-weight: 650; break-after: avoid; }
.subtitle { margin: 0; color: var(--soft); }
.summary { max-width: 46rem; margin: 1.3rem 0; font-size: 1.12rem; }
.note { color: var(--soft); font-size: .85rem; margin: .6rem 0 0; max-width: 46rem; }
.warnings { border-left: 3px solid #e69f00; background: #fff9ec; padding: .7rem 1rem; margin: 1.2rem 0; max-width: 46rem; }
.warnings strong { color: var(--warm); }
.warnings ul { margin: .2rem 0 0; padding-left: 1.1rem; }
dl { display: grid; grid-template-columns: repeat(auto-fill, minmax(11rem, 1fr)); gap: .9rem 1.5rem; margin: 1.2rem 0 0; }
dt { color: var(--soft); font-size: .82rem; }
dd { margin: 0; font-variant-numeric: tabular-nums; overflow-wrap: anywhere; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .92rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; vertical-align: top; padding: .5rem 1rem .5rem 0; }
th { font-weight: 600; color: var(--soft); font-size: .82rem; white-space: nowrap; padding-bottom: .2rem; \
vertical-align: bottom; }
.units th { font-weight: 400; padding-top: 0; padding-bottom: .45rem; }
thead { border-bottom: 1.5px solid var(--ink); }
tbody tr { border-bottom: 1px solid var(--rule); break-inside: avoid; }
.number { text-align: right; white-space: nowrap; padding-left: .6rem; }
.best td { font-weight: 600; }
.best .cell, .best code, .best .source { font-weight: 400; }
.compared { color: var(--soft); }
.source { font-size: .85rem; color: var(--soft); min-width: 12rem; }
code { font: .82em ui-monospace, 'SF Mono', Menlo, Consolas, monospace; color: var(--soft); }
.chips { list-style: none; margin: 0; padding: 0; display: flex; flex-wrap: wrap; gap: .15rem 1.1rem; min-width: 13rem; }
.chip { display: inline-block; width: .85em; height: .85em; border-radius: 3px; vertical-align: -.08em; \
box-shadow: inset 0 0 0 1px rgb(0 0 0 / .22); print-color-adjust: exact; -webkit-print-color-adjust: exact; }
.cell { color: var(--soft); }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 30rem), 1fr)); gap: 1.8rem 2.2rem; }
figure { margin: 0; break-inside: avoid; }
figure svg { display: block; width: 100%; max-width: 46rem; height: auto; }
figcaption { color: var(--soft); font-size: .88rem; margin-top: .3rem; max-width: 40rem; }
@media (max-width: 600px) { main { padding: 1.4rem 1rem 3rem; } h1 { font-size: 1.6rem; } \
dl { grid-template-columns: 1fr 1fr; } }
@media print { @page { margin: 16mm; } body { font-size: 10pt; } main { padding: 0; max-width: none; } \
.figures { grid-template-columns: 1fr 1fr; gap: 1rem; } .scroll { overflow: visible; } h2 { margin-top: 1.4rem; } }
";
